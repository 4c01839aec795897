//! A wall fitted to a noisy frame: how much better the plane knows the range of a pixel than the pixel does.
//!
//! `cargo run --release -p primitives --example fit_wall`
#![allow(clippy::print_stdout)]

use camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion};
use primitives::{PrimitiveKind, PrimitiveOptions, fit_primitive};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::{Flags, RangeFrame, Raster};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let format = ImageFormat::new(176, 144, [0.04, 0.04])?;
    let interior = InteriorOrientation { principal_point_mm: [0.0, 0.0], principal_distance_mm: 8.0 };
    let camera = Camera::new(format, interior, LensDistortion::default())?;
    let mut random = Pcg64::seed_from_u64(1);
    let range = Raster::from_fn(176, 144, |col, row| {
        let noise: f64 = StandardNormal.sample(&mut random);
        (-3.0 / camera.ray([col as f64, row as f64]).z + 0.005 * noise) as f32
    });
    let frame = RangeFrame {
        range,
        sigma: Raster::filled(176, 144, 0.005),
        amplitude: Raster::filled(176, 144, 100.0),
        flags: Raster::filled(176, 144, Flags::empty()),
    };
    let fit = fit_primitive(&frame, &camera, PrimitiveKind::Plane, &PrimitiveOptions::default())?;
    println!("{:?}, sigma0 {:.3}", fit.primitive, fit.sigma0);
    Ok(())
}
