//! How often light from outside the image is suspected: in dim views that have none, and in views that have it.
//!
//! ```sh
//! cargo run --release --example outside_light
//! ```
//! Fails where more than one in a thousand views without such light is suspected, or less than nine of ten whose light from
//! outside is well above what the scene returns.
#![allow(clippy::print_stdout)]

use std::error::Error;
use std::f64::consts::TAU;

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use range_image::{ComplexChannel, Flags, Modulation, Raster};
use scattering_deconvolution::{
    GaussianTerm, OutsideLightDetector, OutsideLightOptions, OutsideLightVerdict, Psf, RestorationOptions, Restorer,
    Scatterer, Side,
};

const SIZE: [usize; 2] = [88, 72];
/// What a canvas has around the image.
const MARGIN: usize = 48;
/// Noise of a single frame.
const SIGMA: f32 = 3.0;
const LIMITS: [f32; 7] = [1.0, 2.0, 5.0, 10.0, 20.0, 40.0, 80.0];
const SEEDS: u64 = 2;

/// Light that a scene returns along a ray of an image, for a source that gives a white wall at 1 m one unit.
type Light = fn([f64; 2], f64) -> [f64; 2];
type Planes = [Vec<f32>; 2];

struct Scene {
    name: &'static str,
    light: Light,
    headings: [f64; 6],
}

const SCENES: [Scene; 3] = [
    Scene { name: "room", light: room, headings: [0.0, 0.35, -0.4, 0.1, -0.15, -1.1] },
    Scene { name: "bricks", light: bricks, headings: [0.2, 0.9, -0.7, 1.9, 2.8, -2.0] },
    Scene { name: "wall", light: wall, headings: [0.0, 0.4, -0.4, 0.7, -0.7, 0.9] },
];

/// Way to the wall of a box from a place in it, the axis of that wall, whether it is the far one, the point, and the light.
fn box_wall([x, y]: [f64; 2], heading: f64, from: [f64; 3], size: [f64; 3]) -> (f64, usize, bool, [f64; 3], f64) {
    let length = (x * x + y * y + 1.0).sqrt();
    let ray = [heading.cos() - x * heading.sin(), heading.sin() + x * heading.cos(), -y].map(|part| part / length);
    let ways = [0, 1, 2].map(|axis| ((if ray[axis] > 0.0 { size[axis] } else { 0.0 } - from[axis]) / ray[axis], axis));
    let (way, axis) = ways.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((1.0, 0));
    let point = [0, 1, 2].map(|i| from[i] + way * ray[i]);
    (way, axis, ray[axis] > 0.0, point, ray[axis].abs() / (way * way * length))
}

fn phasor(amplitude: f64, way: f64, interval_m: f64) -> [f64; 2] {
    let phase = TAU * way / interval_m;
    [amplitude * phase.cos(), amplitude * phase.sin()]
}

fn room(ray: [f64; 2], heading: f64) -> [f64; 2] {
    let (way, axis, far, _, light) = box_wall(ray, heading, [1.0, 1.8, 1.3], [5.0, 4.0, 2.6]);
    phasor(light * [[0.5, 0.4], [0.5, 0.6], [0.4, 0.6]][axis][usize::from(far)], way, 4.9965)
}

/// A hall with walls of bricks, each of its own albedo.
fn bricks(ray: [f64; 2], heading: f64) -> [f64; 2] {
    let (way, axis, _, point, light) = box_wall(ray, heading, [3.0, 2.0, 1.6], [9.0, 7.0, 3.4]);
    let brick = |axis: usize, size: f64| (point[axis] / size).floor();
    let number = 12.9 * brick(0, 0.4) + 78.2 * brick(1, 0.4) + 37.7 * brick(2, 0.25) + 5.3 * axis as f64;
    phasor(light * (0.15 + 0.7 * (number.sin() * 43_758.5).rem_euclid(1.0)), way, 7.495)
}

/// A wall with discs, aslant.
fn wall([x, y]: [f64; 2], tilt: f64) -> [f64; 2] {
    let length = (x * x + y * y + 1.0).sqrt();
    let along = (tilt.sin() * x + 0.2 * tilt.cos() * y + tilt.cos()) / length;
    let way = 2.4 / along.max(0.02);
    let from_disc = |at: f64| (at / 0.5 - (at / 0.5).round()) * 0.5;
    let albedo = if from_disc(x / length * way).hypot(from_disc(y / length * way)) < 0.1 { 0.43 } else { 0.85 };
    phasor(albedo * along.max(0.0) / (way * way), way, 4.9965)
}

fn psf() -> Psf {
    let term = |weight, sigma: f64| GaussianTerm { weight, sigma_px: [sigma, sigma] };
    Psf::Gaussians(vec![term(0.05, 3.0), term(0.16, 20.0)])
}

/// What the camera delivers, without noise, of light on a canvas about the image.
fn scattered(light: impl Fn([isize; 2]) -> [f64; 2]) -> Result<Planes, Box<dyn Error>> {
    let [width, height] = SIZE.map(|count| count + 2 * MARGIN);
    let at = |i: usize| light([i % width, i / width].map(|at| at as isize - MARGIN as isize));
    let [mut re, mut im] = [0, 1].map(|part| (0..width * height).map(|i| at(i)[part] as f32).collect::<Vec<f32>>());
    Scatterer::new(&psf(), width, height)?.apply(&mut re, &mut im)?;
    let rows = |plane: &[f32]| -> Vec<f32> {
        let rows = plane.chunks(width).skip(MARGIN).take(SIZE[1]);
        rows.flat_map(|row| row[MARGIN..MARGIN + SIZE[0]].to_vec()).collect()
    };
    Ok([rows(&re), rows(&im)])
}

/// Light of the scene alone.
fn own(scene: &Scene, heading: f64) -> Result<Planes, Box<dyn Error>> {
    let [width, height] = SIZE.map(|count| count as isize);
    scattered(|[col, row]| {
        if col < 0 || row < 0 || col >= width || row >= height {
            return [0.0, 0.0];
        }
        let ray = [(col, width), (row, height)].map(|(at, count)| (at as f64 - (count as f64 - 1.0) / 2.0) / 70.0);
        (scene.light)(ray, heading)
    })
}

/// Light of an object of amplitude 1 beyond a border.
fn objects() -> Result<Vec<(Side, Planes)>, Box<dyn Error>> {
    let places = [
        (Side::Left, [[-30, -4], [20, 50]]),
        (Side::Right, [[91, 113], [36, 56]]),
        (Side::Top, [[29, 51], [-26, -3]]),
        (Side::Bottom, [[44, 68], [76, 100]]),
    ];
    let object = |(side, [cols, rows]): (Side, [[isize; 2]; 2])| {
        let inside = |[first, end]: [isize; 2], at: isize| (first..end).contains(&at);
        let light =
            scattered(|[col, row]| if inside(cols, col) && inside(rows, row) { [0.8, 0.6] } else { [0.0, 0.0] });
        Ok((side, light?))
    };
    places.into_iter().map(object).collect()
}

/// The verdict on a mean of frames, held to the limit of a single one at the same noise of the phase.
fn verdict(light: &Planes, frames: usize, limit: f32, seed: u64) -> Result<OutsideLightVerdict, Box<dyn Error>> {
    let ([width, height], noisier) = (SIZE, (frames as f32).sqrt());
    let mut generator = Pcg64Mcg::seed_from_u64(seed);
    let mut noisy = |plane: &[f32]| -> Vec<f32> {
        let normal: Vec<f32> = StandardNormal.sample_iter(&mut generator).take(plane.len()).collect();
        plane.iter().zip(normal).map(|(value, normal)| value + SIGMA / noisier * normal).collect()
    };
    let [re, im] = [noisy(&light[0]), noisy(&light[1])];
    let flag = |(re, im): (&f32, &f32)| {
        if re.hypot(*im) < limit / noisier { Flags::LOW_AMPLITUDE } else { Flags::empty() }
    };
    let mut flags = Raster::from_vec(width, height, re.iter().zip(&im).map(flag).collect())?;
    let mut image = ComplexChannel {
        modulation: Modulation::new(20e6)?,
        real: Raster::from_vec(width, height, re)?,
        imaginary: Raster::from_vec(width, height, im)?,
        offset: None,
        sigma: Raster::filled(width, height, SIGMA / noisier),
    };
    Restorer::new(&psf(), width, height, &RestorationOptions::default())?.restore(&mut image)?;
    let detector = OutsideLightDetector::new(&psf(), width, height, &OutsideLightOptions::default())?;
    Ok(detector.detect(&image, &mut flags)?)
}

/// Of views with this much light of the scene and from outside, those suspected at each limit, and those of the right side.
fn counts(scene: &Scene, [power, object]: [f32; 2], frames: usize) -> Result<[[usize; 7]; 2], Box<dyn Error>> {
    let (mut suspected, objects) = ([[0; 7]; 2], objects()?);
    for (view, heading) in scene.headings.iter().enumerate() {
        let own = own(scene, *heading)?;
        let (side, outside) = &objects[view % objects.len()];
        let mix = |part: usize| own[part].iter().zip(&outside[part]).map(|(a, b)| power * a + object * b).collect();
        let light = [mix(0), mix(1)];
        for (index, limit) in LIMITS.into_iter().enumerate() {
            for seed in 0..SEEDS {
                if let OutsideLightVerdict::Suspected(found) =
                    verdict(&light, frames, limit, 7000 + 100 * view as u64 + seed)?
                {
                    suspected[0][index] += 1;
                    suspected[1][index] += usize::from(found.suspected_side == *side);
                }
            }
        }
    }
    Ok(suspected)
}

/// Prints the head of a table, a column for each limit.
fn head(what: &str) {
    let limits = LIMITS.map(|limit| limit.to_string()).join(" | ");
    println!("| {what}: scene | light | frames | {limits} |\n|{}", "---|".repeat(LIMITS.len() + 3));
}

fn row(scene: &str, light: f32, frames: usize, cells: &[String; LIMITS.len()]) {
    println!("| {scene} | {light} | {frames} | {} |", cells.join(" | "));
}

fn main() -> Result<(), Box<dyn Error>> {
    let views = SEEDS as usize * 6;
    let (mut alarms, mut all) = (0, 0);
    println!("Suspected of {views} views at limits of a single frame's amplitude, noise {SIGMA}\n");
    head("nothing outside");
    for scene in &SCENES {
        for power in [30.0, 100.0, 300.0, 1000.0] {
            for frames in [1, 4, 16, 64] {
                let [found, _] = counts(scene, [power, 0.0], frames)?;
                row(scene.name, power, frames, &found.map(|count| count.to_string()));
                alarms += found.iter().sum::<usize>();
                all += LIMITS.len() * views;
            }
        }
    }
    println!("\n{alarms} of {all}\n");
    head("an object of amplitude 1500 outside; how many on its side");
    let (mut right, mut asked) = (0, 0);
    for scene in &SCENES {
        for power in [0.0, 1.0, 3.0, 10.0, 30.0] {
            for frames in [1, 4, 16] {
                let [found, sides] = counts(scene, [power, 1500.0], frames)?;
                let cell = |limit: usize| format!("{}; {}", found[limit], sides[limit]);
                row(scene.name, power, frames, &std::array::from_fn(cell));
                if power <= 1.0 && frames == 1 {
                    right += sides[4..].iter().sum::<usize>();
                    asked += 3 * views;
                }
            }
        }
    }
    println!("\n{right} of {asked} where the scene returns next to nothing and the limit is 20 or more");
    if 1000 * alarms > all || 10 * right < 9 * asked {
        return Err(format!("{alarms} false alarms of {all}, {right} found of {asked}").into());
    }
    Ok(())
}
