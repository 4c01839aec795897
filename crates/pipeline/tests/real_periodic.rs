//! What is left between the demodulated ranges of a real camera and its own: by wavelength, amplitude and place.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

mod common;

use std::path::Path;

use common::{fixtures, has_capture};
use pipeline::{Plan, Silent, ViewData, process};
use self_calibration::{
    AmplitudeOrPositionOptions, RangeDifference, RangeTermOptions, Scale, TrendOptions, TrendSample,
    amplitude_or_position, estimate_range_terms, test_trends,
};

/// Every so many columns and rows.
const STEP: usize = 4;

/// Unflagged pixels: demodulated range against the camera's own, with their columns and rows.
fn differences() -> (Vec<RangeDifference>, Vec<[usize; 2]>, f64) {
    let plan = "(name: \"x\", stages: [Demodulate(low_amplitude: 40), Unwrap(maximum_range_m: 2.49), Flag()])";
    let plan = Plan::from_ron(plan, Path::new("x.ron")).unwrap();
    let outcome = process(&plan, &fixtures().join("surveys/mlx75027_scene"), None, &Silent).unwrap();
    let view = &outcome.views[0];
    let ViewData::Range(frame) = &view.data else { unreachable!("ranges after unwrapping") };
    let (own, interval_m) = (view.reference_range.as_ref().unwrap(), view.modulation.unwrap().ambiguity_interval_m());
    let format = outcome.camera.format;
    let (mut differences, mut pixels) = (Vec::new(), Vec::new());
    for row in (0..frame.height()).step_by(STEP) {
        for col in (0..frame.width()).step_by(STEP) {
            let (observed, own) = (f64::from(frame.range[(col, row)]), f64::from(own[(col, row)]));
            let apart = observed - own;
            let wrapped = apart - (apart / interval_m).round() * interval_m;
            // What the camera's own flags or filters changed by more than this is no correction of ranges.
            if !(frame.flags[(col, row)].is_empty() && wrapped.abs() < 0.06 && own > 0.0) {
                continue;
            }
            let [x_mm, y_mm] = format.image_from_pixel([col as f64, row as f64]);
            let amplitude = f64::from(frame.amplitude[(col, row)]);
            let (reference_range_m, sigma_m) = (observed - wrapped, 0.01);
            differences.push(RangeDifference {
                observed_range_m: observed,
                reference_range_m,
                x_mm,
                y_mm,
                amplitude,
                sigma_m,
            });
            pixels.push([col, row]);
        }
    }
    (differences, pixels, interval_m)
}

#[test]
fn the_residual_of_an_mlx75027_by_wavelength() {
    if !has_capture("mlx75027_scene") {
        return;
    }
    let (differences, pixels, interval_m) = differences();
    let options = RangeTermOptions { largest_inflation: 1e4, ..RangeTermOptions::default() };
    let calibration = estimate_range_terms(&differences, interval_m, &options).unwrap();
    let parameters = calibration.parameters(Scale::Posterior).unwrap();
    println!("{} pixels, sigma0 {:.3}", differences.len(), calibration.sigma0().unwrap());
    let spans = differences
        .iter()
        .fold([f64::MAX, 0.0_f64], |[l, h], d| [l.min(d.observed_range_m), h.max(d.observed_range_m)]);
    println!("ranges {spans:.3?} m of U = {interval_m:.3} m");
    for parameter in &parameters[..9] {
        println!("  {} {:+.3} mm +- {:.3}", parameter.name, 1e3 * parameter.value, 1e3 * parameter.sigma);
    }
    for (wave, pair) in ["U", "U/2", "U/4"].into_iter().zip(parameters[1..7].chunks_exact(2)) {
        let amplitude = pair[0].value.hypot(pair[1].value);
        println!("  wavelength {wave}: {:.2} mm +- {:.2}", 1e3 * amplitude, 1e3 * pair[0].sigma.max(pair[1].sigma));
    }
    println!("rms before {:.2} mm, after {:.2} mm", 1e3 * calibration.rms_before_m(), 1e3 * calibration.rms_after_m());
    let samples: Vec<TrendSample> = differences
        .iter()
        .zip(&pixels)
        .zip(calibration.residuals_m())
        .map(|((d, [col, row]), &residual_m)| TrendSample {
            residual_m,
            sigma_m: d.sigma_m,
            range_m: d.observed_range_m,
            amplitude: d.amplitude,
            column: *col as f64,
            row: *row as f64,
            time_s: f64::NAN,
            frame: 0,
        })
        .collect();
    for test in test_trends(&samples, &TrendOptions::default()).unwrap().tests {
        println!(
            "  {}: {:?}, rms {:.2} mm, p {:.1e}, cells {:?}",
            test.variable.name(),
            test.verdict,
            1e3 * test.rms_m,
            test.p_value,
            test.cell
        );
    }
    let cause = amplitude_or_position(
        &differences,
        interval_m,
        &AmplitudeOrPositionOptions { terms: options, ..AmplitudeOrPositionOptions::default() },
    );
    println!("{cause:?}");
    assert!(calibration.rms_after_m() < calibration.rms_before_m());
}
