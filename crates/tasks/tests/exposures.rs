//! A white board near the camera and a dark wall behind it, taken with three integration times: what fusion makes of them.

use std::path::{Path, PathBuf};

use pipeline::{Plan, Processed, Silent, View, ViewData, process};
use tasks::{ExplainRequest, explain};

use crate::common::simulated_from;

const SCENE: &str = "(
    scene: (objects: [
        (name: \"board\", shape: Rectangle(corner_m: (-6.0, -5.0, 1.2), edge_u_m: (6.0, 0.0, 0.0),
            edge_v_m: (0.0, 10.0, 0.0)), albedo: 0.9),
        (name: \"wall\", shape: Rectangle(corner_m: (-6.0, -5.0, -1.0), edge_u_m: (12.0, 0.0, 0.0),
            edge_v_m: (0.0, 10.0, 0.0)), albedo: 0.05),
    ]),
    camera: (geometry: (format: (width: 64, height: 48, pixel_pitch_mm: (0.1, 0.1)),
        interior: (principal_point_mm: (0.0, 0.0), principal_distance_mm: 8.0)), modulation_hz: [30.0e6]),
    illumination: (source_power: 8.0e6, modulation_contrast: 0.5),
    exposure: (frames_per_station: 2, integration_time_s: 0.00025, further_integration_times_s: [0.001, 0.004]),
    stations: [(name: \"A\", position_m: (0.0, 0.0, 2.0),
        attitude: Euler(omega_deg: 0.0, phi_deg: 0.0, kappa_deg: 0.0))],
    errors: (noise: (shot_variance_per_unit: 0.025, dark_sigma: 2.0), digitisation: (sample_type: U16, saturation: 12000.0)),
)";

fn survey(folder: &Path) -> PathBuf {
    let scene = folder.join("exposures.ron");
    std::fs::write(&scene, SCENE).unwrap();
    simulated_from(&scene, 3, folder)
}

fn plan(stages: &str) -> Plan {
    Plan::from_ron(&format!("(name: \"x\", stages: [{stages}])"), Path::new("x.ron")).unwrap()
}

fn run(survey: &Path, stages: &str) -> Processed {
    process(&plan(stages), survey, None, &Silent).unwrap()
}

const SINGLE: &str = "Demodulate(low_amplitude: 11.3), Average(), Unwrap(maximum_range_m: 4.99),";

/// Root mean square error of the unflagged pixels of a half of the image, metre, and their share of it.
fn quality(view: &View, left: bool) -> (f64, f64) {
    let ViewData::Range(frame) = &view.data else { unreachable!("ranges at the end") };
    let truth = &view.truth.as_ref().unwrap().range;
    let (mut squares, mut good, mut all) = (0.0, 0.0, 0.0);
    for row in 0..frame.height() {
        // The edge of the board is left out.
        for col in if left { 0..30 } else { 34..64 } {
            all += 1.0;
            if frame.flags[(col, row)].is_empty() {
                good += 1.0;
                squares += f64::from(frame.range[(col, row)] - truth[(col, row)]).powi(2);
            }
        }
    }
    (f64::sqrt(squares / good), good / all)
}

#[test]
fn near_and_dark_surfaces_are_both_kept() {
    let folder = tempfile::tempdir().unwrap();
    let survey = survey(folder.path());
    let single = run(&survey, &format!("{SINGLE} PointCloud(), Flag()"));
    assert_eq!(single.views.len(), 3, "one view an integration time");
    let fused = run(&survey, &format!("{SINGLE} FuseExposures(), PointCloud(), Flag()"));
    assert_eq!((fused.views.len(), fused.views[0].cloud.is_some(), fused.views[0].frames.len()), (1, true, 6));
    let mut kept = [0.0_f64; 3];
    for left in [true, false] {
        let (error, share) = quality(&fused.views[0], left);
        let singles: Vec<(f64, f64)> = single.views.iter().map(|view| quality(view, left)).collect();
        println!("left {left}: {:.2} mm on {share:.3}; single exposures {singles:.4?}", 1e3 * error);
        let best = singles.iter().filter(|(_, share)| *share > 0.5).map(|(error, _)| *error).fold(f64::NAN, f64::min);
        // 1440 pixels know a deviation to 2 %; three times that.
        assert!(error < 1.06 * best, "{error} m, best exposure {best} m");
        assert!(share > 0.98, "{share}");
        for (kept, (_, share)) in kept.iter_mut().zip(&singles) {
            *kept += share / 2.0;
        }
    }
    // The shortest shows both, the dark surface with ten times the error.
    assert!(kept[1..].iter().all(|share| *share < 0.9), "no longer exposure shows both: {kept:?}");
    let findings = &fused.stages.iter().find(|stage| stage.name == "FuseExposures").unwrap().findings;
    assert!(findings["contradictory_px"] < 3.0 && findings["saturated_px"] < 1.0, "{findings:?}");
}

#[test]
fn a_fused_pixel_is_explained_and_exposures_without_average_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let survey = survey(folder.path());
    let request = ExplainRequest {
        survey: survey.clone(),
        frame: "0".to_owned(),
        pixel: [50, 20],
        plan: Some(plan(&format!("{SINGLE} FuseExposures(), PointCloud(), Flag()"))),
        calibration: None,
    };
    let explanation = explain(&request, &Silent).unwrap();
    let line = explanation.stages.iter().find(|line| line.stage == "FuseExposures").unwrap();
    assert!(line.parts.iter().all(|part| part.what.contains("exposures")), "{line:?}");
    assert!(explanation.flags.is_empty(), "{:?}", explanation.flags);
    // Samples that contradict each other everywhere are laid to another camera, or to a noise model that says too little.
    let little = "Demodulate(noise: (shot_variance_per_unit: 1.0e-4, dark_sigma: 0.01)), Average()";
    let disturbed = explain(&ExplainRequest { plan: Some(plan(little)), ..request.clone() }, &Silent).unwrap();
    let reason = disturbed.flags.iter().find(|flag| flag.flag == "interference").unwrap();
    assert!(reason.reason.contains("another camera"), "{reason:?}");
    // The board is saturated in every exposure if the sensor ends at a tenth of its light.
    let everywhere = survey.join("survey.ron");
    let text = std::fs::read_to_string(&everywhere).unwrap();
    assert!(text.contains("12000"), "{text}");
    std::fs::write(&everywhere, text.replacen("12000", "1200", 1)).unwrap();
    let explanation = explain(&ExplainRequest { pixel: [5, 20], ..request }, &Silent).unwrap();
    assert_eq!(explanation.range_m, None);
    assert!(explanation.flags.iter().any(|flag| flag.flag == "saturated"), "{:?}", explanation.flags);
    let refused = process(
        &plan("Demodulate(), Unwrap(maximum_range_m: 4.99), FuseExposures(), PointCloud()"),
        &survey,
        None,
        &Silent,
    );
    assert!(refused.unwrap_err().to_string().contains("Average"));
}
