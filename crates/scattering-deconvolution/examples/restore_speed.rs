//! Time and exactness of restorations, on one thread: prints `method size milliseconds error_left_cm`.
//!
//! Without arguments on simulated scenes of three sizes. With `WIDTH HEIGHT REAL IMAGINARY [OUT]` on an observed image:
//! two files of little-endian 32-bit floats, row by row, at 20 MHz; what is restored goes to `OUT_<method>_real.f32` and
//! `OUT_<method>_imaginary.f32`, and the error left is not known. The point spread function is the same for both:
//! 2 % in a Gaussian of 12 pixels and 4 % in one of a fifth of the width.
#![allow(clippy::print_stdout)]

use std::f64::consts::{PI, TAU};
use std::time::Instant;

use range_image::{ComplexChannel, Flags, Modulation, Raster};
use scattering_deconvolution::{GaussianTerm, GridSpacing, Psf, Refinement, RestorationOptions, Restorer, Scatterer};

type Failure = Box<dyn std::error::Error + Send + Sync>;

/// An observed image, and the phases that it should have where they are known.
struct Image {
    size: [usize; 2],
    planes: [Vec<f32>; 2],
    truth: Option<Vec<f32>>,
}

#[derive(Clone, Copy, PartialEq)]
enum Extent {
    Planes,
    Sigma,
    SigmaAndFlags,
}

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let images = match &arguments[..] {
        [] => [[176, 144], [640, 480], [1024, 1024]].map(simulated).into_iter().collect::<Result<Vec<_>, _>>()?,
        [width, height, real, imaginary, ..] => {
            let planes = [read(real)?, read(imaginary)?];
            vec![Image { size: [width.parse()?, height.parse()?], planes, truth: None }]
        }
        _ => return Err("expected WIDTH HEIGHT REAL IMAGINARY [OUT]".into()),
    };
    for image in &images {
        pool.install(|| measure(image, arguments.get(4).map(String::as_str)))?;
    }
    Ok(())
}

fn measure(image: &Image, out: Option<&str>) -> Result<(), Failure> {
    let decimated = RestorationOptions::default();
    let exact = RestorationOptions { grid_spacing: GridSpacing::EveryPixel, ..decimated };
    let filter_only = |options| RestorationOptions { refinement: Refinement::FilterOnly, ..options };
    for (method, options, extent) in [
        ("decimated", decimated, Extent::Planes),
        ("decimated+sigma", decimated, Extent::Sigma),
        ("decimated+sigma+mask", decimated, Extent::SigmaAndFlags),
        ("decimated_filter", filter_only(decimated), Extent::Planes),
        ("padded_filter", filter_only(exact), Extent::Planes),
        ("padded", exact, Extent::Planes),
    ] {
        let (milliseconds, restored) = time(image, &options, extent)?;
        let [width, height] = image.size;
        println!("{method} {width}x{height} {milliseconds:.3} {:.4}", error_left_cm(image, &restored)?);
        if let Some(out) = out {
            for (name, plane) in [("real", &restored.real), ("imaginary", &restored.imaginary)] {
                let bytes: Vec<u8> = plane.as_slice().iter().flat_map(|value| value.to_le_bytes()).collect();
                std::fs::write(format!("{out}_{method}_{name}.f32"), bytes)?;
            }
        }
    }
    Ok(())
}

/// Least time of many runs in milliseconds, and the restored image.
fn time(image: &Image, options: &RestorationOptions, extent: Extent) -> Result<(f64, ComplexChannel), Failure> {
    let [width, height] = image.size;
    let mut restorer = Restorer::new(&psf(width), width, height, options)?;
    let flags = Raster::from_fn(width, height, |col, row| match (col + 7 * row) % 997 {
        0 => Flags::SATURATED,
        _ => Flags::empty(),
    });
    let observed = ComplexChannel {
        modulation: Modulation::new(20e6)?,
        real: Raster::from_vec(width, height, image.planes[0].clone())?,
        imaginary: Raster::from_vec(width, height, image.planes[1].clone())?,
        offset: None,
        sigma: Raster::filled(width, height, 1.0),
    };
    let mut restored = observed.clone();
    let mut least = f64::INFINITY;
    let start = Instant::now();
    let mut runs = 0;
    while runs < 5 || runs < 1000 && start.elapsed().as_secs_f64() < 1.0 {
        for (to, from) in [(&mut restored.real, &observed.real), (&mut restored.imaginary, &observed.imaginary)] {
            to.as_mut_slice().copy_from_slice(from.as_slice());
        }
        restored.sigma.as_mut_slice().copy_from_slice(observed.sigma.as_slice());
        let begun = Instant::now();
        match extent {
            Extent::Planes => {
                restorer.restore_planes(restored.real.as_mut_slice(), restored.imaginary.as_mut_slice())?
            }
            Extent::Sigma => restorer.restore(&mut restored)?,
            Extent::SigmaAndFlags => restorer.restore_flagged(&mut restored, &flags)?,
        };
        least = least.min(1e3 * begun.elapsed().as_secs_f64());
        runs += 1;
    }
    Ok((least, restored))
}

/// Mean range error over all pixels.
fn error_left_cm(image: &Image, restored: &ComplexChannel) -> Result<f64, Failure> {
    let Some(truth) = &image.truth else { return Ok(f64::NAN) };
    let turn = |(found, truth): (&f32, &f32)| (f64::from(found - truth) + PI).rem_euclid(TAU) - PI;
    let phase = restored.phase();
    let sum: f64 = phase.as_slice().iter().zip(truth).map(turn).map(f64::abs).sum();
    Ok(100.0 * Modulation::new(20e6)?.range_from_phase(sum / truth.len() as f64))
}

fn psf(width: usize) -> Psf {
    let term = |weight, sigma: f64| GaussianTerm { weight, sigma_px: [sigma, sigma] };
    Psf::Gaussians(vec![term(0.02, 12.0), term(0.04, width as f64 / 5.0)])
}

/// A wall at 4 m with a texture, and a bright object at 0.8 m that the left and the lower border cut.
fn simulated([width, height]: [usize; 2]) -> Result<Image, Failure> {
    let modulation = Modulation::new(20e6)?;
    let is_object = |pixel: usize| 3 * (pixel % width) < width && 2 * (pixel / width) > height;
    let phase = |pixel: usize| {
        let slope = 0.5 * (pixel % width) as f64 / width as f64;
        modulation.phase_from_range(if is_object(pixel) { 0.8 } else { 4.0 + slope }) as f32
    };
    let amplitude = |pixel: usize| {
        let texture = 1.0 + 0.3 * ((pixel % width / 5 + pixel / width / 7) % 2) as f32;
        texture * if is_object(pixel) { 2000.0 } else { 60.0 }
    };
    let truth: Vec<f32> = (0..width * height).map(phase).collect();
    let part = |turn: fn(f32) -> f32| -> Vec<f32> {
        truth.iter().enumerate().map(|(pixel, &phase)| amplitude(pixel) * turn(phase)).collect()
    };
    let [mut real, mut imaginary] = [part(f32::cos), part(f32::sin)];
    Scatterer::new(&psf(width), width, height)?.apply(&mut real, &mut imaginary)?;
    Ok(Image { size: [width, height], planes: [real, imaginary], truth: Some(truth) })
}

fn read(file: &str) -> Result<Vec<f32>, Failure> {
    let bytes = std::fs::read(file).map_err(|error| format!("{file}: {error}"))?;
    let number = |bytes: &[u8]| bytes.try_into().map(f32::from_le_bytes);
    Ok(bytes.chunks(4).map(number).collect::<Result<_, _>>().map_err(|_| format!("{file}: not in fours of bytes"))?)
}
