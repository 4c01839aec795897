//! Correction of whole frames, its inverse, and flags of gross errors.
#![allow(missing_docs, clippy::unwrap_used)]

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use error_models::{
    AmplitudeHyperbola, FixedPattern, FurtherShape, FurtherTerms, GrossErrorOptions, PolynomialShape, RangeErrorModel,
    RangeTerms, SurfaceShape, correct_frame, distort_frame, flag_gross_errors,
};
use range_image::{Flags, ImageFormat, RangeFrame, Raster};

fn model() -> RangeErrorModel {
    RangeErrorModel {
        ambiguity_interval_m: 7.494_811_45,
        terms: RangeTerms { d0: 0.024, periodic: [0.01, -0.02, 0.003, 0.01, -0.005, 0.006], e1: 1e-3, e2: -2e-4 },
        hyperbola: Some(AmplitudeHyperbola { h1: 1e-3, h2: 2e-2, h3: 90.0, amplitude_span: [20.0, 3000.0] }),
        range_span_m: Some([0.2, 20.0]),
        further: FurtherTerms::default(),
    }
}

/// The same hyperbola with a spline of 24 knots, a cubic in range and a surface of order 3.
fn with_further_terms(format: &ImageFormat) -> RangeErrorModel {
    let shape = FurtherShape {
        spline_knots: Some(24),
        polynomial: Some(PolynomialShape { order: 3, range_span_m: [0.2, 20.0] }),
        surface: Some(SurfaceShape::over_image(3, format, [0.0; 2])),
    };
    let mut model = model().with_further(&shape).unwrap();
    let values: Vec<f64> = (0..model.parameter_count()).map(|i| 2e-3 * (i as f64).sin()).collect();
    model.set_parameter_values(&values).unwrap();
    model
}

fn frame(width: usize, height: usize) -> RangeFrame {
    RangeFrame {
        range: Raster::from_fn(width, height, |col, row| 1.0 + ((col * 7 + row * 13) % 1000) as f32 * 0.01),
        sigma: Raster::filled(width, height, 0.01),
        amplitude: Raster::from_fn(width, height, |col, row| 30.0 + ((col * 3 + row * 5) % 997) as f32),
        flags: Raster::filled(width, height, Flags::empty()),
    }
}

fn frames(criterion: &mut Criterion) {
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    for (width, height) in [(176, 144), (640, 480), (1024, 1024)] {
        let format = ImageFormat::new(width, height, [0.01; 2]).unwrap();
        let pattern = FixedPattern { width, height, offset_m: vec![1e-3; width * height], sigma_m: Vec::new() };
        let (frame, model) = (frame(width, height), model());
        let size = format!("{width}x{height}, one thread");
        let mut group = criterion.benchmark_group("CorrectRange");
        group.throughput(Throughput::Elements((width * height) as u64));
        group.bench_function(&size, |bencher| {
            bencher.iter_batched_ref(
                || frame.clone(),
                |frame| one_thread.install(|| correct_frame(frame, &model, &format, [0.0; 2], Some(&pattern))),
                BatchSize::LargeInput,
            );
        });
        let further = with_further_terms(&format);
        group.bench_function(format!("spline, polynomial, surface, {size}"), |bencher| {
            bencher.iter_batched_ref(
                || frame.clone(),
                |frame| one_thread.install(|| correct_frame(frame, &further, &format, [0.0; 2], Some(&pattern))),
                BatchSize::LargeInput,
            );
        });
        group.finish();
        let mut group = criterion.benchmark_group("distort_frame");
        group.throughput(Throughput::Elements((width * height) as u64));
        group.bench_function(&size, |bencher| {
            bencher.iter_batched_ref(
                || frame.clone(),
                |frame| one_thread.install(|| distort_frame(frame, &model, &format, [0.0; 2], Some(&pattern))),
                BatchSize::LargeInput,
            );
        });
        group.finish();
        let mut group = criterion.benchmark_group("Flag");
        group.throughput(Throughput::Elements((width * height) as u64));
        group.bench_function(&size, |bencher| {
            let (mut frame, options) = (stepped_wall(width, height), GrossErrorOptions::default());
            bencher.iter(|| one_thread.install(|| flag_gross_errors(&mut frame, &options)));
        });
        group.finish();
    }
}

/// An oblique wall with a box in front of it every 40 columns.
fn stepped_wall(width: usize, height: usize) -> RangeFrame {
    let range =
        Raster::from_fn(width, height, |col, row| 3.0 + 0.002 * row as f32 - if col % 40 < 20 { 0.0 } else { 1.0 });
    RangeFrame { range, ..frame(width, height) }
}

criterion_group!(benches, frames);
criterion_main!(benches);
