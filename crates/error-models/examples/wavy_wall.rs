//! A wall at rising distance: what an uncorrected camera shows, and what the correction leaves.
#![allow(clippy::print_stdout)]

use error_models::{AmplitudeHyperbola, RangeErrorModel, RangeTerms, correct_frame, distort_frame};
use range_image::{Flags, ImageFormat, Modulation, RangeFrame, Raster};

fn main() -> Result<(), error_models::Error> {
    let format = ImageFormat::new(64, 48, [0.04, 0.04])?;
    let model = RangeErrorModel {
        terms: RangeTerms { d0: 0.024, periodic: [0.004, 0.0, 0.0, 0.003, 0.008, -0.004], e1: 1e-3, e2: 0.0 },
        hyperbola: Some(AmplitudeHyperbola { h1: 0.002, h2: 0.09, h3: 90.0, amplitude_span: [20.0, 5000.0] }),
        range_span_m: Some([0.3, 8.7]),
        ..RangeErrorModel::error_free(Modulation::new(30e6)?.ambiguity_interval_m())
    };
    model.validate()?;
    println!("range m   shown error mm   left over mm   of which the amplitude did mm   flagged");
    for step in 1..=20 {
        let range = 0.5 * step as f32;
        let mut frame = wall(&format, range);
        distort_frame(&mut frame, &model, &format, [0.0, 0.0], None)?;
        let shown = 1e3 * mean_error(&frame, range);
        let ledger = correct_frame(&mut frame, &model, &format, [0.0, 0.0], None)?;
        println!(
            "{range:7.2}   {shown:14.2}   {:12.4}   {:29.2}   {:7}",
            1e3 * mean_error(&frame, range),
            -1e3 * ledger.amplitude.mean_m,
            ledger.outside_span
        );
    }
    Ok(())
}

/// A wall whose amplitude falls with the square of the range.
fn wall(format: &ImageFormat, range: f32) -> RangeFrame {
    let (width, height) = (format.width, format.height);
    RangeFrame {
        range: Raster::filled(width, height, range),
        sigma: Raster::filled(width, height, 0.002 * range * range),
        amplitude: Raster::filled(width, height, 1200.0 / (range * range)),
        flags: Raster::filled(width, height, Flags::empty()),
    }
}

fn mean_error(frame: &RangeFrame, truth: f32) -> f64 {
    let errors = frame.range.as_slice().iter().map(|range| f64::from(range - truth));
    errors.sum::<f64>() / frame.range.len() as f64
}
