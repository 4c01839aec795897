//! How often something is read as a coded ring that is none, or as another: `wrong_codes [IMAGES] [FOLDER]` prints, for each kind of
//! image, discs that were looked at (candidates), rings read, read wrongly, and the rate that the wrong ones stay below at a level of
//! 95 %. FOLDER: images of scenes without rings (PNG, JPEG, in any depth of folders); without it simulated ones alone.
#![allow(clippy::print_stdout)]

use std::error::Error;
use std::path::{Path, PathBuf};

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use targets::range_image::Raster;
use targets::{CodedOptions, codes, find_circles, find_coded};

#[path = "../tests/rendering.rs"]
mod rendering;

/// Rings of an image: columns and rows, and the side of a cell, pixel.
const CELLS: [usize; 2] = [4, 3];
const CELL_PX: f64 = 56.0;

/// What was counted.
#[derive(Default)]
struct Count {
    images: usize,
    candidates: usize,
    read: usize,
    wrong: usize,
}

impl Count {
    fn print(&self, kind: &str) {
        // Quantile of the Poisson distribution: none in 3.0, of more by the normal one.
        let wrong = self.wrong as f64;
        let most = if self.wrong == 0 { 3.0 } else { wrong + 1.92 + 1.645 * (wrong + 0.68).sqrt() };
        let bound = most / self.candidates.max(1) as f64;
        println!("| {kind} | {} | {} | {} | {} | {bound:.1e} |", self.images, self.candidates, self.read, self.wrong);
    }

    fn add(&mut self, image: &Raster<f32>, is_right: impl Fn([f64; 2], usize) -> bool) -> Result<(), Box<dyn Error>> {
        let options = CodedOptions::default();
        self.images += 1;
        self.candidates += find_circles(image, &options.circles)?.len();
        for ring in find_coded(image, &options)? {
            self.read += 1;
            self.wrong += usize::from(!is_right(ring.circle.centre.pixel, ring.code.id));
        }
        Ok(())
    }
}

/// What is wrong with the rings of an image.
#[derive(Clone, Copy, PartialEq)]
enum Defect {
    None,
    /// A bar of any brightness lies across.
    Bar,
    /// A blot of any brightness and about the size of a few sectors.
    Blot,
    /// Sectors are turned to the other colour, two of them at a time.
    Repainted,
    /// Rings of other kinds: cut at any angles.
    Foreign,
    /// Discs and other discs about them instead of rings.
    Discs,
}

struct Ring {
    centre: [f64; 2],
    radius: f64,
    squeeze: f64,
    turn: f64,
    code: usize,
    /// Where a foreign ring changes its colour, sectors.
    edges: Vec<f64>,
    /// Direction, distance from the middle and half width (radii) and value of what lies across.
    bar: [f64; 4],
}

impl Ring {
    fn draw(random: &mut Pcg64, place: usize, count: usize) -> Self {
        let mut draw = |low: f64, high: f64| low + (high - low) * random.random::<f64>();
        let middle = [(place % CELLS[0]) as f64 + 0.5, (place / CELLS[0]) as f64 + 0.5].map(|index| index * CELL_PX);
        let mut edges: Vec<f64> = (0..2 * draw(2.0, 6.0) as usize).map(|_| draw(0.0, 12.0)).collect();
        edges.sort_by(f64::total_cmp);
        Self {
            centre: [middle[0] + draw(-3.0, 3.0), middle[1] + draw(-3.0, 3.0)],
            radius: draw(3.0, 6.0),
            squeeze: draw(0.6, 1.0),
            turn: draw(0.0, 12.0),
            code: (draw(0.0, count as f64) as usize).min(count - 1),
            edges,
            bar: [draw(0.0, std::f64::consts::TAU), draw(1.4, 3.2), draw(0.3, 1.3), draw(0.0, 1.0)],
        }
    }

    /// Light at a place, 0 to 1.
    fn value(&self, word: u32, defect: Defect, col: f64, row: f64) -> f64 {
        let (x, y) = ((col - self.centre[0]) / self.radius, (row - self.centre[1]) / (self.radius * self.squeeze));
        let parts = x.hypot(y);
        let sector = (y.atan2(x) * 6.0 / std::f64::consts::PI + self.turn).rem_euclid(12.0);
        let [direction, off, half, value] = self.bar;
        let along = x * direction.cos() + y * direction.sin();
        let across = y * direction.cos() - x * direction.sin();
        match defect {
            Defect::Bar if (along - off).abs() < half && across.abs() < 12.0 => return value,
            Defect::Blot if (along - 2.5).hypot(across) < 0.6 + half => return value,
            _ => {}
        }
        if parts < 1.0 {
            return 1.0;
        }
        if !(2.0..3.0).contains(&parts) {
            return 0.0;
        }
        let set = match defect {
            // Half of a sector's width is painted over, of two sectors.
            Defect::Repainted => {
                let at = sector as usize;
                let own = word >> at & 1 == 1;
                let painted = at % 6 == (self.code % 6) && (2.0..2.0 + half.min(0.95)).contains(&parts);
                own != painted
            }
            Defect::Foreign => self.edges.iter().filter(|edge| **edge < sector).count() % 2 == 1,
            Defect::Discs => (sector.fract() - 0.5).hypot((parts - 2.5) * 1.2) < 0.3 + 0.2 * half,
            _ => word >> (sector as usize) & 1 == 1,
        };
        f64::from(u8::from(set))
    }
}

fn rings(defect: Defect, images: usize) -> Result<Count, Box<dyn Error>> {
    let all = codes(12)?;
    let mut count = Count::default();
    for seed in 0..images as u64 {
        let mut random = Pcg64::seed_from_u64(seed ^ 0x5eed);
        let rings: Vec<Ring> =
            (0..CELLS[0] * CELLS[1]).map(|place| Ring::draw(&mut random, place, all.len())).collect();
        let value = |col: f64, row: f64| {
            let [i, j] = [col, row].map(|at| (at / CELL_PX).max(0.0) as usize);
            let ring = if i < CELLS[0] { rings.get(j * CELLS[0] + i) } else { None };
            40.0 + 140.0 * ring.map_or(0.0, |ring| ring.value(all[ring.code].word, defect, col, row))
        };
        let size = CELLS.map(|cells| (cells as f64 * CELL_PX) as usize);
        let clean = rendering::render(size[0], size[1], 0.6, value);
        let image = rendering::noisy(&clean, 3.0, seed);
        count.add(&image, |[col, row], id| {
            // What is no coded ring has no right code.
            ![Defect::Foreign, Defect::Discs].contains(&defect)
                && rings
                    .iter()
                    .any(|ring| ring.code == id && (ring.centre[0] - col).hypot(ring.centre[1] - row) < ring.radius)
        })?;
    }
    Ok(count)
}

/// Noise, smoothed by Gaussians of some widths: spots of all sizes.
fn textures(images: usize, is_binary: bool) -> Result<Count, Box<dyn Error>> {
    let mut count = Count::default();
    for seed in 0..images as u64 {
        let noise = rendering::noisy(&Raster::filled(240, 180, 0.0), 1.0, seed);
        let mut sum = Raster::filled(240, 180, 120.0_f32);
        for (sigma, weight) in [(1.5, 40.0), (3.0, 90.0), (6.0, 160.0)] {
            let smooth = rendering::render(240, 180, sigma, |col, row| {
                let at = |value: f64, size: usize| value.round().clamp(0.0, size as f64 - 1.0) as usize;
                f64::from(noise[(at(col, 240), at(row, 180))])
            });
            let sums = sum.as_mut_slice().iter_mut().zip(smooth.as_slice());
            sums.for_each(|(sum, value)| *sum += weight as f32 * value);
        }
        if is_binary {
            sum = rendering::render(240, 180, 0.6, |col, row| {
                let at = |value: f64, size: usize| value.round().clamp(0.0, size as f64 - 1.0) as usize;
                if sum[(at(col, 240), at(row, 180))] > 120.0 { 180.0 } else { 40.0 }
            });
        }
        count.add(&rendering::noisy(&sum, 2.0, seed + 1), |_, _| false)?;
    }
    Ok(count)
}

/// Pictures in a folder and those below it.
fn pictures(folder: &Path, found: &mut Vec<PathBuf>) -> std::io::Result<()> {
    let mut entries: Vec<PathBuf> = std::fs::read_dir(folder)?.flatten().map(|entry| entry.path()).collect();
    entries.sort();
    for path in entries {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        if path.is_dir() {
            pictures(&path, found)?;
        } else if ending.is_some_and(|ending| ["png", "jpg", "jpeg"].contains(&ending.as_str())) {
            found.push(path);
        }
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let images: usize = arguments.next().map_or(Ok(100), |text| text.parse())?;
    println!("| images | number | discs looked at | read as rings | wrongly | rate of wrong ones below, at 95 % |");
    println!("|---|---|---|---|---|---|");
    for (defect, kind) in [
        (Defect::None, "rings"),
        (Defect::Bar, "rings with a bar across"),
        (Defect::Blot, "rings with a blot"),
        (Defect::Repainted, "rings with two sectors painted over in part"),
        (Defect::Foreign, "rings cut at any angles"),
        (Defect::Discs, "discs about discs"),
    ] {
        rings(defect, images)?.print(kind);
    }
    textures(images, false)?.print("smoothed noise");
    textures(images, true)?.print("blots of two colours");
    if let Some(folder) = arguments.next() {
        let mut paths = Vec::new();
        pictures(Path::new(&folder), &mut paths)?;
        let mut count = Count::default();
        for path in paths {
            // Depths are no light, and some files are of a kind that is not read.
            if let Some(image) = range_io::grey::read(&path).ok().filter(|_| !path.to_string_lossy().contains("depth"))
            {
                count.add(&image, |_, _| false)?;
            }
        }
        count.print("pictures of scenes without rings");
    }
    Ok(())
}
