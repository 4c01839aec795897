//! Flags of the stages `Unwrap`, `RepairWraps` and `Multipath` sit on what is wrong, and on little else.

use std::path::Path;

use pipeline::{DoubtKind, Judged, Plan, Processed, RunRequest, Silent, ViewData, process};
use range_image::Flags;
use range_io::survey::{InputFrame, Level, Survey, read_frame, write_frame};

use crate::common::{fixtures, has_capture, simulated_with};

fn run(survey: &Path, stages: &str) -> Processed {
    let plan = Plan::from_ron(&format!("(name: \"test\", stages: [{stages}])"), "test.ron".as_ref()).unwrap();
    process(&plan, survey, None, &Silent).unwrap()
}

/// Shares of all pixels: wrong by more than half a metre, flagged so though right, and of the wrong ones those flagged.
fn shares(outcome: &Processed, flag: Flags, wrong_m: impl Fn(f32) -> f32) -> [f64; 3] {
    let (mut all, mut wrong, mut falsely, mut found) = (0.0, 0.0, 0.0, 0.0);
    for view in &outcome.views {
        let ViewData::Range(frame) = &view.data else { unreachable!() };
        let truth = view.truth.as_ref().unwrap().range.as_slice();
        let pixels = frame.range.as_slice().iter().zip(frame.sigma.as_slice()).zip(frame.flags.as_slice()).zip(truth);
        for (((range, sigma), flags), truth) in pixels.filter(|((_, _), truth)| truth.is_finite()) {
            let (bad, flagged) = ((range - truth).abs() > wrong_m(*sigma), flags.intersects(flag));
            all += 1.0;
            wrong += f64::from(u8::from(bad));
            falsely += f64::from(u8::from(flagged && !bad));
            found += f64::from(u8::from(flagged && bad));
        }
    }
    [wrong / all, falsely / all, found / f64::max(wrong, 1.0)]
}

const UNTIL_RANGES: &str = "Demodulate(low_amplitude: 20), Average(), Deconvolve(), Unwrap(maximum_range_m: 12)";

#[test]
fn unsure_wraps_are_few_in_good_light_and_hit_the_wrong_ones() {
    require_few_unsure_wraps(&[("8.0e6", 1), ("0.8e6", 4)]);
}

#[test]
#[ignore = "long: cargo xtask verify tests"]
fn unsure_wraps_are_few_in_any_light_with_any_frames() {
    require_few_unsure_wraps(&[("8.0e6", 1), ("8.0e6", 16), ("2.4e6", 4), ("0.8e6", 4), ("0.8e6", 16)]);
}

/// Powers of the light and frames at each station; the bars are those of each survey.
fn require_few_unsure_wraps(surveys: &[(&str, usize)]) {
    for (light, frames) in surveys {
        let folder = tempfile::tempdir().unwrap();
        let frames = format!("frames_per_station: {frames}");
        let text = std::fs::read_to_string(fixtures().join("scenes/room_small.ron")).unwrap();
        let text = text.replace("source_power: 8.0e6", &format!("source_power: {light}"));
        let scene = folder.path().join("scene.ron");
        std::fs::write(&scene, text.replace("frames_per_station: 4", &frames)).unwrap();
        let survey = crate::common::simulated_from(&scene, 17, folder.path());
        let outcome = run(&survey, UNTIL_RANGES);
        let [wrong, falsely, found] = shares(&outcome, Flags::UNWRAP_UNSURE, |_| 2.0);
        println!("source {light}, {frames}: wrong {wrong:.4}, flagged though right {falsely:.4}, found {found:.3}");
        assert!(falsely < 2.0 * wrong + 0.02 && found > 0.9, "{light} {frames}: {wrong} {falsely} {found}");
    }
}

#[test]
fn the_method_of_unwrapping_is_chosen_by_the_plan() {
    require_methods_as_planned(&[("8.0e6", 18), ("0.12e6", 20)]);
    let plan = Plan::from_ron("(name: \"x\", stages: [Unwrap(method: best)])", "x.ron".as_ref());
    let message = plan.unwrap_err().to_string();
    assert!(message.contains("best") && message.contains("auto"), "{message}");
}

#[test]
#[ignore = "long: cargo xtask verify tests"]
fn the_filter_is_chosen_where_light_begins_to_lack() {
    require_methods_as_planned(&[("0.24e6", 19)]);
}

/// Powers of the light, with the seeds of the surveys; the bars are those of each survey.
fn require_methods_as_planned(surveys: &[(&str, u64)]) {
    let ranges = |outcome: &Processed| -> Vec<u32> {
        let frames = outcome.views.iter().map(|view| {
            let ViewData::Range(frame) = &view.data else { unreachable!() };
            frame.range.as_slice().iter().map(|range| range.to_bits()).collect::<Vec<u32>>()
        });
        frames.flatten().collect()
    };
    for &(light, seed) in surveys {
        let folder = tempfile::tempdir().unwrap();
        let text = std::fs::read_to_string(fixtures().join("scenes/room_small.ron")).unwrap();
        let text = text.replace("source_power: 8.0e6", &format!("source_power: {light}"));
        let scene = folder.path().join("scene.ron");
        std::fs::write(&scene, text.replace("frames_per_station: 4", "frames_per_station: 1")).unwrap();
        let survey = crate::common::simulated_from(&scene, seed, folder.path());
        let by = |method: &str| {
            let stages = UNTIL_RANGES.replace("maximum_range_m: 12", &format!("maximum_range_m: 12, method: {method}"));
            let outcome = run(&survey, &stages);
            let shares = shares(&outcome, Flags::UNWRAP_UNSURE, |_| 2.0);
            println!("source {light}, {method}: wrong, flagged though right, found {shares:.4?}");
            (outcome, shares)
        };
        let [(tree, tree_shares), (_, filter), (_, cuts), (auto, auto_shares)] =
            ["tree", "filter", "cuts", "auto"].map(by);
        if light == "8.0e6" {
            assert!(ranges(&tree) == ranges(&run(&survey, UNTIL_RANGES)), "the tree is the default");
            assert!(ranges(&tree) == ranges(&auto), "enough light needs no filter");
        } else {
            assert!(
                auto_shares[0] < 0.7 * tree_shares[0] && filter[0] < tree_shares[0],
                "{tree_shares:?} {auto_shares:?} {cuts:?}"
            );
        }
    }
}

#[test]
fn two_frequencies_that_disagree_by_a_centimetre_are_sure_of_their_counts() {
    let folder = tempfile::tempdir().unwrap();
    let ranges = "range: [(ambiguity_interval_m: 1.8737028625, terms: (d0: 0.025)), (";
    let text = std::fs::read_to_string(fixtures().join("scenes/room_small.ron")).unwrap();
    let text = text.replace("range: [(", ranges).replace("4.996540966666667", "2.4982704833333335");
    let scene = folder.path().join("scene.ron");
    std::fs::write(&scene, text.replace("[30.0e6]", "[80.0e6, 60.0e6]")).unwrap();
    let survey = crate::common::simulated_from(&scene, 5, folder.path());
    let stages = UNTIL_RANGES.replace("12", "7.4");
    let outcome = run(&survey, &format!("{stages}, CorrectRange(), CorrectImagePoint(), Multipath()"));
    let flags = Flags::UNWRAP_UNSURE | Flags::MULTIPATH;
    let [wrong, falsely, found] = shares(&outcome, flags, |_| 0.5);
    println!("wrong {wrong:.4}, flagged though right {falsely:.4}, found {found:.3}");
    assert!(falsely < 2.0 * wrong + 0.02 && found > 0.6, "{wrong} {falsely} {found}");
}

#[test]
fn multipath_is_flagged_where_it_is_and_nowhere_else() {
    let wrong_m = |sigma: f32| (3.0 * sigma).max(0.02);
    let with = |change| {
        let folder = tempfile::tempdir().unwrap();
        let survey = simulated_with("corner_multipath", change, folder.path());
        let outcome = run(&survey, "Demodulate(), Average(), Unwrap(), Multipath()");
        shares(&outcome, Flags::MULTIPATH, wrong_m)
    };
    for change in [["albedo: 0.35", "albedo: 0.35"], ["albedo: 0.6", "albedo: 0.2"], ["8.0e6", "0.8e6"]] {
        let [wrong, falsely, found] = with(change);
        println!("{change:?}: wrong {wrong:.4}, flagged though right {falsely:.4}, found {found:.3}");
        assert!(wrong > 0.9 && found > 0.9 && falsely < 0.01, "{change:?}: {wrong} {falsely} {found}");
    }
    let [wrong, falsely, _] = with(["multipath: (directions: 256, seed: 1),", ""]);
    println!("without: wrong {wrong:.4}, flagged though right {falsely:.4}");
    assert!(falsely < 2.0 * wrong + 0.02);
}

#[test]
fn well_lit_surfaces_of_an_sr4000_are_sure() {
    if !has_capture("sr4000_steps") {
        return;
    }
    let survey = fixtures().join("surveys/sr4000_steps");
    let outcome = run(&survey, "Average(), RepairWraps(maximum_range_m: 10)");
    for view in &outcome.views {
        let ViewData::Range(frame) = &view.data else { unreachable!() };
        let lit = frame.amplitude.as_slice().iter().zip(frame.flags.as_slice()).filter(|(a, _)| **a > 100.0);
        let unsure = lit.clone().filter(|(_, flags)| flags.contains(Flags::UNWRAP_UNSURE)).count();
        let share = unsure as f64 / lit.count() as f64;
        println!("{}: {share:.3} of the pixels above amplitude 100 are unsure", view.station);
        // Most of these are the wall behind, at the end of the interval, where the light goes.
        assert!(share < 0.15, "{}: {share}", view.station);
    }
}

#[test]
fn a_survey_without_amplitudes_is_doubted_as_a_whole() {
    if !has_capture("sr4000_steps") {
        return;
    }
    let (folder, out) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let root = fixtures().join("surveys/sr4000_steps");
    let mut survey = Survey::read(root.join(Survey::FILE_NAME)).unwrap();
    survey.frames.truncate(1);
    let InputFrame::Range { range, .. } = read_frame(&survey, &root, 0).unwrap() else { unreachable!() };
    assert_eq!(survey.level, Level::Range);
    let frame = InputFrame::Range { range, amplitude: None, confidence: None };
    write_frame(folder.path().join("0.npz"), &frame).unwrap();
    survey.frames[0].file = "0.npz".into();
    survey.write(folder.path().join(Survey::FILE_NAME)).unwrap();
    let stages = "(name: \"test\", stages: [RepairWraps(maximum_range_m: 10), PointCloud()])";
    let request = RunRequest {
        plan: Plan::from_ron(stages, "test.ron".as_ref()).unwrap(),
        plan_path: "test.ron".into(),
        survey: Some(folder.path().to_owned()),
        calibration: None,
        out: out.path().join("out"),
    };
    let summary = pipeline::run(&request, &Silent).unwrap();
    println!("{summary}");
    assert!(summary.flags_fraction.get("unwrap_unsure").is_none_or(|share| *share < 0.01));
    let wraps: Vec<_> = summary.doubts().iter().filter(|doubt| doubt.kind == DoubtKind::Wraps).collect();
    assert_eq!(wraps.len(), 1, "one doubt for the survey");
}
