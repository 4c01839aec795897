//! What is left between the demodulated ranges of a real camera and its own: by wavelength, amplitude and place.

use std::path::Path;

use pipeline::{Plan, Silent, ViewData, process};
use range_calibration::{
    AmplitudeOrPositionOptions, RangeDifference, RangeTermOptions, Scale, amplitude_or_position, estimate_range_terms,
};

use crate::common::{fixtures, has_capture};

/// Every so many columns and rows.
const STEP: usize = 4;

/// Demodulated ranges of unflagged pixels against the camera's own, and the ambiguity interval, metre.
fn differences() -> (Vec<RangeDifference>, f64) {
    let plan = "(name: \"x\", stages: [Demodulate(low_amplitude: 40), Unwrap(maximum_range_m: 2.49), Flag()])";
    let plan = Plan::from_ron(plan, Path::new("x.ron")).unwrap();
    let outcome = process(&plan, &fixtures().join("surveys/mlx75027_scene"), None, &Silent).unwrap();
    let view = &outcome.views[0];
    let ViewData::Range(frame) = &view.data else { unreachable!("ranges after unwrapping") };
    let (own, interval_m) = (view.reference_range.as_ref().unwrap(), view.modulation.unwrap().ambiguity_interval_m());
    let format = outcome.camera.format;
    let mut differences = Vec::new();
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
        }
    }
    (differences, interval_m)
}

#[test]
fn the_residual_of_an_mlx75027_by_wavelength() {
    if !has_capture("mlx75027_scene") {
        return;
    }
    let (differences, interval_m) = differences();
    // A third of the ambiguity interval tells nothing of waves of U and U/2: d0, d6 and d7, e1 and e2.
    let held = ["d2", "d3", "d4", "d5"].into_iter();
    let options = held.fold(RangeTermOptions::default(), |options, name| options.hold(name, 0.0).unwrap());
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
    let [d6, d7] = [5, 6].map(|index| parameters[index].value);
    let sigma_m = parameters[5].sigma.max(parameters[6].sigma);
    println!("  wavelength U/4: {:.2} mm +- {:.2}", 1e3 * d6.hypot(d7), 1e3 * sigma_m);
    println!("rms before {:.2} mm, after {:.2} mm", 1e3 * calibration.rms_before_m(), 1e3 * calibration.rms_after_m());
    let cause = amplitude_or_position(
        &differences,
        interval_m,
        &AmplitudeOrPositionOptions { terms: options, ..AmplitudeOrPositionOptions::default() },
    )
    .unwrap();
    println!("{cause:?}");
    let without = ["d6", "d7"].into_iter().fold(options, |options, name| options.hold(name, 0.0).unwrap());
    let without = estimate_range_terms(&differences, interval_m, &without).unwrap();
    println!("rms without the wave {:.2} mm", 1e3 * without.rms_after_m());
    // Four samples of a light that is not a sine: of what the camera takes off, this wave is the larger part beside the delays.
    assert!(d6.hypot(d7) > 20.0 * sigma_m, "{d6} {d7} ± {sigma_m}");
    assert!(calibration.rms_after_m() < 0.7 * without.rms_after_m(), "the wave explains what delays do not");
    assert!(
        calibration.rms_after_m() < 0.004,
        "a third of the 11 mm is left: filters, and place and amplitude together"
    );
}
