//! A wave that a calibration left in the ranges, found among residuals.
//!
//! `cargo run --release -p residual-tests --example trends`
#![allow(clippy::print_stdout)]

use residual_tests::{TrendOptions, TrendSample, test_trends};

fn main() -> Result<(), residual_tests::Error> {
    // Residuals of 20 frames of 30 by 30 pixels: noise of 2 mm, and a wave of 1 mm with the range.
    let mut state = 1_u64;
    let mut noise = move || {
        // Sum of twelve uniform numbers: about normal, of variance 1.
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / (1_u64 << 24) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    };
    let mut samples = Vec::new();
    for frame in 0..20 {
        for (column, row) in (0..900).map(|pixel| (f64::from(pixel % 30), f64::from(pixel / 30))) {
            let range_m = 1.0 + 0.05 * f64::from(frame) + 0.1 * column;
            let residual_m = 0.001 * (4.0 * range_m).sin() + 0.002 * noise();
            let time_s = f64::from(frame);
            let frame = frame as usize;
            samples.push(TrendSample {
                residual_m,
                sigma_m: 0.002,
                range_m,
                amplitude: 100.0,
                column,
                row,
                time_s,
                frame,
            });
        }
    }
    let report = test_trends(&samples, &TrendOptions::default())?;
    for test in &report.tests {
        println!(
            "{:18} {:?}, {:.2} mm, p = {:.1e}",
            test.variable.name(),
            test.verdict,
            1e3 * test.rms_m,
            test.p_value
        );
    }
    Ok(())
}
