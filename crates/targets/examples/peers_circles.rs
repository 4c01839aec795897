//! Discs beside OpenCV's: `peers_circles FOLDER DIAMETER_PX IMAGES` writes `<k>.pgm` (8 bit, contrast 100, noise 2) and prints a line
//! `disc <k> <true col> <true row> <found col> <found row> <squared error>` a disc, and `ms <k> <time>` an image. What OpenCV finds in
//! the images says `xtask/peers/circles_peers.py FOLDER`, which reads these lines.
#![allow(clippy::print_stdout)]

use std::error::Error;
use std::time::Instant;

use targets::nalgebra::Vector2;
use targets::range_image::Raster;
use targets::{CircleOptions, find_circles};

#[path = "../tests/rendering.rs"]
mod rendering;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, diameter, images] = &arguments[..] else { return Err("FOLDER DIAMETER_PX IMAGES".into()) };
    let (diameter, images): (f64, u64) = (diameter.parse()?, images.parse()?);
    let cell = (2.0 * diameter).max(24.0);
    for k in 0..images {
        // Golden-ratio steps: places in a pixel, tilts of 0 to 60° and directions of every kind.
        let step = |disc: usize, factor: f64| ((20 * k as usize + disc) as f64 * factor).fract();
        let discs: Vec<[f64; 2]> = (0..20)
            .map(|disc| {
                let place = [(disc % 5) as f64 + 0.5, (disc / 5) as f64 + 0.5].map(|index| index * cell);
                [place[0] + step(disc, 0.618_034) - 0.5, place[1] + step(disc, 0.754_878) - 0.5]
            })
            .collect();
        let shapes: Vec<_> = discs
            .iter()
            .enumerate()
            .map(|(disc, centre)| {
                let tilt = (60.0 * step(disc, 0.569_84)).to_radians();
                rendering::ellipse(*centre, [0.5 * diameter, 0.5 * diameter * tilt.cos()], 3.2 * step(disc, 0.819_173))
            })
            .collect();
        let value = |col: f64, row: f64| {
            let [i, j] = [col, row].map(|at| (at / cell).max(0.0) as usize);
            let disc = if i < 5 { shapes.get(j * 5 + i) } else { None };
            60.0 + 100.0 * disc.map_or(0.0, |disc| disc(col, row))
        };
        let clean = rendering::render((5.0 * cell) as usize, (4.0 * cell) as usize, 0.5, value);
        let image = rendering::noisy(&clean, 2.0, k).map(|value| value.round().clamp(0.0, 255.0));
        write(&image, &format!("{folder}/{k}.pgm"))?;
        let start = Instant::now();
        let found = find_circles(&image, &CircleOptions::default())?;
        println!("ms {k} {:.2}", start.elapsed().as_secs_f64() * 1e3);
        for truth in &discs {
            let off = |pixel: [f64; 2]| Vector2::from(pixel) - Vector2::from(*truth);
            let near =
                found.iter().map(|disc| disc.centre).min_by(|a, b| off(a.pixel).norm().total_cmp(&off(b.pixel).norm()));
            let near = near.filter(|point| off(point.pixel).norm() < 2.0);
            let [col, row] = near.map_or([f64::NAN; 2], |point| point.pixel);
            let squared = near.and_then(|point| {
                let off = off(point.pixel);
                Some(off.dot(&(point.covariance.try_inverse()? * off)))
            });
            println!("disc {k} {:.5} {:.5} {col:.5} {row:.5} {:.4}", truth[0], truth[1], squared.unwrap_or(f64::NAN));
        }
    }
    Ok(())
}

fn write(image: &Raster<f32>, path: &str) -> std::io::Result<()> {
    let mut bytes = format!("P5\n{} {}\n255\n", image.width(), image.height()).into_bytes();
    bytes.extend(image.as_slice().iter().map(|value| *value as u8));
    std::fs::write(path, bytes)
}
