//! Times the correction of a frame of 640 x 480 pixels, for comparisons between machines and versions.
//!
//! Prints lines `name milliseconds milliseconds`: the least and the median time of many runs on one thread. Other sizes:
//! two arguments, columns and rows.
#![allow(clippy::print_stdout)]

use std::hint::black_box;
use std::time::Instant;

use error_models::{
    AmplitudeHyperbola, FixedPattern, FurtherShape, PolynomialShape, RangeErrorModel, RangeTerms, SurfaceShape,
    correct_frame,
};
use range_image::{Flags, ImageFormat, RangeFrame, Raster};

const RUNS: usize = 1000;

fn main() -> Result<(), error_models::Error> {
    let mut sizes = std::env::args().skip(1).filter_map(|argument| argument.parse::<usize>().ok());
    let (width, height) = (sizes.next().unwrap_or(640), sizes.next().unwrap_or(480));
    match rayon::ThreadPoolBuilder::new().num_threads(1).build() {
        Ok(pool) => pool.install(|| measure(width, height)),
        Err(_) => measure(width, height),
    }
}

fn measure(width: usize, height: usize) -> Result<(), error_models::Error> {
    let format = ImageFormat::new(width, height, [0.01; 2])?;
    let pattern = |sigma_m: Vec<f32>| FixedPattern { width, height, offset_m: vec![1e-3; width * height], sigma_m };
    let (bare, known) = (pattern(Vec::new()), pattern(vec![2e-4; width * height]));
    let (physical, further) = (model(), with_further_terms(&format)?);
    report("sines_plane_hyperbola", &physical, &format, None)?;
    report("sines_plane_hyperbola_pattern", &physical, &format, Some(&bare))?;
    report("sines_plane_hyperbola_pattern_with_sigma", &physical, &format, Some(&known))?;
    report("spline_polynomial_surface_hyperbola_pattern", &further, &format, Some(&bare))
}

fn model() -> RangeErrorModel {
    RangeErrorModel {
        terms: RangeTerms { d0: 0.024, periodic: [0.01, -0.02, 0.003, 0.01, -0.005, 0.006], e1: 1e-3, e2: -2e-4 },
        hyperbola: Some(AmplitudeHyperbola { h1: 1e-3, h2: 2e-2, h3: 90.0, amplitude_span: [20.0, 3000.0] }),
        range_span_m: Some([0.2, 20.0]),
        ..RangeErrorModel::error_free(7.494_811_45)
    }
}

/// The same hyperbola with a spline of 24 knots, a cubic in range and a surface of order 3.
fn with_further_terms(format: &ImageFormat) -> Result<RangeErrorModel, error_models::Error> {
    let mut model = model().with_further(&FurtherShape {
        spline_knots: Some(24),
        polynomial: Some(PolynomialShape { order: 3, range_span_m: [0.2, 20.0] }),
        surface: Some(SurfaceShape::over_image(3, format, [0.0; 2])),
    })?;
    let values: Vec<f64> = (0..model.parameter_count()).map(|i| 2e-3 * (i as f64).sin()).collect();
    model.set_parameter_values(&values)?;
    Ok(model)
}

fn report(
    name: &str,
    model: &RangeErrorModel,
    format: &ImageFormat,
    pattern: Option<&FixedPattern>,
) -> Result<(), error_models::Error> {
    let (width, height) = (format.width, format.height);
    let frame = RangeFrame {
        range: Raster::from_fn(width, height, |col, row| 1.0 + ((col * 7 + row * 13) % 1000) as f32 * 0.01),
        sigma: Raster::filled(width, height, 0.01),
        amplitude: Raster::from_fn(width, height, |col, row| 30.0 + ((col * 3 + row * 5) % 997) as f32),
        flags: Raster::filled(width, height, Flags::empty()),
    };
    let (mut corrected, mut times) = (frame.clone(), Vec::with_capacity(RUNS));
    for _ in 0..RUNS {
        corrected.range.as_mut_slice().copy_from_slice(frame.range.as_slice());
        corrected.sigma.as_mut_slice().copy_from_slice(frame.sigma.as_slice());
        let start = Instant::now();
        correct_frame(black_box(&mut corrected), model, format, [0.0; 2], pattern)?;
        times.push(1e3 * start.elapsed().as_secs_f64());
    }
    times.sort_by(f64::total_cmp);
    println!("{name} {:.3} {:.3}", times[0], times[RUNS / 2]);
    Ok(())
}
