//! Light that came by more than one way, pixels of two surfaces, samples that contradict each other, wraps that are lost.

use std::path::{Path, PathBuf};

use pipeline::{Plan, Processed, Silent, SimulateSource, ViewData, process, simulate};
use range_image::{Flags, RangeFrame};

use crate::common::fixtures;

/// A fixture's scene with a piece of its text replaced, simulated.
fn simulated(scene: &str, from: &str, to: &str, folder: &Path) -> PathBuf {
    let text = std::fs::read_to_string(fixtures().join(format!("scenes/{scene}.ron"))).unwrap();
    assert!(text.contains(from), "{scene} does not contain {from:?}");
    std::fs::write(folder.join("scene.ron"), text.replace(from, to)).unwrap();
    let source = SimulateSource {
        scene: "scene.ron".to_owned(),
        seed: 1,
        approximate_position_sigma_m: 0.0,
        approximate_attitude_sigma_deg: 0.0,
        gross_error_share: 0.0,
    };
    simulate(&source, folder, &folder.join("survey"), &Silent).unwrap();
    folder.join("survey")
}

fn run(survey: &Path, stages: &str) -> Processed {
    let plan = Plan::from_ron(&format!("(name: \"test\", stages: [{stages}])"), "test.ron".as_ref()).unwrap();
    process(&plan, survey, None, &Silent).unwrap()
}

fn finding(outcome: &Processed, stage: &str, name: &str) -> f64 {
    outcome.stages.iter().find(|done| done.name == stage).unwrap().findings[name]
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (ma, mb) = (mean(a), mean(b));
    let moment = |f: &dyn Fn(f64, f64) -> f64| a.iter().zip(b).map(|(x, y)| f(x - ma, y - mb)).sum::<f64>();
    moment(&|x, y| x * y) / (moment(&|x, _| x * x) * moment(&|_, y| y * y)).sqrt()
}

#[test]
fn a_corner_is_at_risk_where_its_ranges_are_too_long() {
    let folder = tempfile::tempdir().unwrap();
    let survey = simulated("corner_multipath", "30.0e6", "30.0e6", folder.path());
    let outcome =
        run(&survey, "Demodulate(), Average(), Unwrap(), Multipath(flag_risk_above_m: 0.02), PointCloud(), Flag()");
    let view = &outcome.views[0];
    let (ViewData::Range(frame), Some(risk)) = (&view.data, &view.multipath_risk_m) else { unreachable!() };
    let truth = &view.truth.as_ref().unwrap().range;
    let (mut expected, mut found) = (Vec::new(), Vec::new());
    for index in 0..risk.len() {
        let error = f64::from(frame.range.as_slice()[index] - truth.as_slice()[index]);
        if risk.as_slice()[index].is_finite() && error.is_finite() {
            expected.push(f64::from(risk.as_slice()[index]));
            found.push(error);
        }
    }
    let share = median(&expected) / median(&found);
    let correlation = correlation(&expected, &found);
    println!("error {} m, expected {} m, correlation {correlation}", median(&found), median(&expected));
    assert!(median(&found) > 0.01, "light that bounced makes ranges too long");
    // The floor and the walls beside the camera are nearest to the source and out of view: about half comes from there.
    assert!((0.4..1.1).contains(&share), "{share}");
    assert!(correlation > 0.5, "{correlation}");
    let flagged = frame.flags.as_slice().iter().filter(|flags| flags.contains(Flags::MULTIPATH)).count();
    assert_eq!(finding(&outcome, "Multipath", "at_risk_px"), flagged as f64);
    assert!(flagged > 0);
}

#[test]
fn frequencies_that_contradict_each_other_are_flagged_or_resolved() {
    let folder = tempfile::tempdir().unwrap();
    let survey = simulated("corner_multipath", "[30.0e6]", "[20.0e6, 50.0e6, 80.0e6]", folder.path());
    let until = |options: &str| {
        let stages = format!("Demodulate(), Average(), Unwrap(maximum_range_m: 7), Multipath({options})");
        run(&survey, &stages)
    };
    let flagged = until("floor_m: 0.002, flag_risk_above_m: None");
    let contradictions = finding(&flagged, "Multipath", "contradictions_px");
    println!("{contradictions} pixels contradict themselves");
    // False alarms alone would be less than one of 6336 pixels.
    assert!(contradictions > 60.0);
    let resolved = until("floor_m: 0.002, flag_risk_above_m: None, treatment: resolve");
    let count = finding(&resolved, "Multipath", "resolved_px");
    let (ViewData::Range(before), ViewData::Range(after)) = (&flagged.views[0].data, &resolved.views[0].data) else {
        unreachable!()
    };
    let truth = resolved.views[0].truth.as_ref().unwrap().range.as_slice();
    let is_resolved = |index: &usize| {
        let [before, after] = [before, after].map(|frame| frame.flags.as_slice()[*index].contains(Flags::MULTIPATH));
        before && !after
    };
    let pixels: Vec<usize> = (0..truth.len()).filter(is_resolved).collect();
    let error = |frame: &RangeFrame, index: usize| f64::from(frame.range.as_slice()[index] - truth[index]);
    let median_error = |frame| median(&pixels.iter().map(|&index| error(frame, index).abs()).collect::<Vec<_>>());
    let squares = pixels.iter().map(|&index| (error(after, index) / f64::from(after.sigma.as_slice()[index])).powi(2));
    let normalised = (squares.sum::<f64>() / pixels.len() as f64).sqrt();
    let (before_m, after_m) = (median_error(before), median_error(after));
    println!("{count} are resolved: {before_m} m before, {after_m} m after, {normalised} of their sigmas");
    assert_eq!(count, pixels.len() as f64);
    // A corner is no single second path but a wall of them: two paths take a part of the error off, and sigma knows it.
    assert!(after_m < 0.8 * before_m);
    assert!((0.6..1.5).contains(&normalised), "{normalised}");
}

#[test]
fn mixed_pixels_are_flagged_dropped_or_split() {
    let folder = tempfile::tempdir().unwrap();
    let survey = simulated("foreground", "frames_per_station: 4", "frames_per_station: 1", folder.path());
    let outcomes = ["flag", "drop", "split"].map(|treatment| {
        let flag = format!("Flag(mixed_pixels: (treatment: {treatment}))");
        run(&survey, &format!("Demodulate(), Average(), Deconvolve(), Unwrap(), CorrectRange(), PointCloud(), {flag}"))
    });
    let points = |outcome: &Processed| {
        let clouds = outcome.views.iter().filter_map(|view| view.cloud.as_ref());
        let finite = clouds.flat_map(|cloud| &cloud.points).filter(|point| point[0].is_finite());
        finite.count() + outcome.views.iter().map(|view| view.further_points.len()).sum::<usize>()
    };
    let [flagged, dropped, split] = outcomes.each_ref().map(points);
    let mixed = finding(&outcomes[0], "Flag", "mixed_pixels") as usize;
    println!("{mixed} mixed pixels: {flagged} points flagged, {dropped} dropped, {split} split");
    assert!(mixed > 50);
    assert_eq!(flagged - dropped, mixed, "each mixed pixel loses its point");
    assert!(split > flagged + mixed / 4, "a good part of them gives two points");
}

#[test]
fn samples_that_agree_are_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let survey = simulated("background", "frames_per_station: 4", "frames_per_station: 1", folder.path());
    let outcome = run(&survey, "Demodulate()");
    let inconsistent = finding(&outcome, "Demodulate", "inconsistent_px");
    // One in ten thousand of 6 x 14256 pixels by chance, five deviations above.
    assert!(inconsistent < 8.6 + 5.0 * 8.6_f64.sqrt(), "{inconsistent}");
}

#[test]
fn wraps_are_repaired_only_where_there_are_no_phases() {
    let folder = tempfile::tempdir().unwrap();
    let survey = simulated("corner_multipath", "30.0e6", "30.0e6", folder.path());
    let plan = Plan::from_ron("(name: \"test\", stages: [Demodulate(), Unwrap(), RepairWraps()])", "test.ron".as_ref());
    let error = process(&plan.unwrap(), &survey, None, &Silent).unwrap_err();
    assert!(error.to_string().contains("RepairWraps") && error.to_string().contains("range"), "{error}");
}
