//! A pixel's ledger: its parts add up, agree with a whole run, and each flag has its reason.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use nalgebra::Vector3;
use pipeline::{Plan, Silent, SimulateSource, ViewData, process, simulate};
use range_image::Flags;
use range_io::npz::NpzWriter;
use tasks::{ExplainRequest, Explanation, explain};

use crate::common;
use crate::common::fixtures;

/// The small room as a survey.
fn room() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let survey = folder.path().join("survey");
    let source = SimulateSource {
        scene: fixtures().join("scenes/room_small.ron").display().to_string(),
        seed: 1,
        approximate_position_sigma_m: 0.05,
        approximate_attitude_sigma_deg: 2.0,
        gross_error_share: 0.01,
    };
    simulate(&source, Path::new(""), &survey, &Silent).unwrap();
    (folder, survey)
}

/// The stages of the small room up to its flags, with thresholds that some pixels miss.
fn plan() -> Plan {
    let stages = "Demodulate(low_amplitude: 40), Average(), Deconvolve(), Unwrap(maximum_range_m: 12), CorrectRange(), \
                  CorrectImagePoint(), Multipath(), PointCloud(), Flag(maximum_sigma_m: 0.03), Register()";
    Plan::from_ron(&format!("(name: \"x\", stages: [{stages}])"), Path::new("x.ron")).unwrap()
}

fn request(survey: &Path, frame: &str, pixel: [usize; 2]) -> ExplainRequest {
    let (plan, calibration) = (Some(plan()), None);
    ExplainRequest { survey: survey.to_owned(), frame: frame.to_owned(), pixel, plan, calibration }
}

/// Parts add up to stages, stages to the whole, to the rounding of single-precision ranges below 16 m.
fn check_sums(found: &Explanation) {
    let rounding_m = 2e-6;
    let mut range_m = found.raw_range_m.unwrap();
    for line in &found.stages {
        if let Some(change) = line.change_m {
            let parts: f64 = line.parts.iter().map(|part| part.change_m).sum();
            assert!((parts - change).abs() < rounding_m, "{}: {parts} {change}", line.stage);
            range_m += parts;
        }
    }
    assert!((range_m - found.range_m.unwrap()).abs() < rounding_m, "{range_m} {:?}", found.range_m);
    let moved = found.range_m.unwrap() - found.raw_range_m.unwrap();
    assert!((found.moved_m + found.whole_intervals_m - moved).abs() < rounding_m);
}

#[test]
fn parts_add_up_and_agree_with_the_run_and_every_flag_has_a_reason() {
    let (_folder, survey) = room();
    let mut stages = plan();
    stages.stages.pop();
    let outcome = process(&stages, &survey, None, &Silent).unwrap();
    let view = &outcome.views[0];
    let ViewData::Range(frame) = &view.data else { unreachable!("ranges at the end") };
    let cloud = view.cloud.as_ref().unwrap();
    let ranges: Vec<f64> = cloud.points.iter().map(|point| Vector3::from(*point).norm()).collect();
    // The middle, a corner, the pixel whose width does most, and for each flag the first pixel that carries it.
    let width = frame.width();
    let by_width = |index: &usize| (ranges[*index] - f64::from(frame.range.as_slice()[*index])).abs();
    let known = (0..ranges.len()).filter(|index| by_width(index).is_finite());
    let widest = known.max_by(|a, b| by_width(a).total_cmp(&by_width(b))).unwrap();
    assert!(by_width(&widest) > 1e-3);
    let mut pixels = vec![[66, 54], [0, 0], [widest % width, widest / width]];
    for (flag, _) in Flags::NAMED {
        let place = frame.flags.as_slice().iter().position(|flags| flags.contains(flag));
        pixels.extend(place.map(|index| [index % width, index / width]));
    }
    let (mut groups, mut flags) = (BTreeSet::new(), BTreeSet::new());
    for [col, row] in pixels {
        let found = explain(&request(&survey, "0", [col, row]), &Silent).unwrap();
        let range = ranges[row * width + col] as f32;
        assert_eq!(found.range_m.map(|range| range as f32), Some(range).filter(|range| range.is_finite()));
        let named: Flags = Flags::NAMED
            .into_iter()
            .filter(|(_, n)| found.flags.iter().any(|f| f.flag == *n))
            .map(|(f, _)| f)
            .collect();
        assert_eq!(named, frame.flags[(col, row)], "{found}");
        for reason in &found.flags {
            assert!(reason.stage.is_some() && reason.reason.len() > 10, "{reason:?}");
            flags.insert(reason.flag);
        }
        if let Some(range_m) = found.range_m {
            check_sums(&found);
            let point = found.point_m.unwrap();
            let length = point.iter().map(|x| x * x).sum::<f64>().sqrt();
            assert!((length - range_m).abs() < 1e-9);
            let in_cloud = Vector3::from(cloud.points[row * width + col]);
            assert!((Vector3::from(point) - in_cloud).norm() < 1e-6, "{point:?} {in_cloud}");
        }
        groups.extend(found.stages.iter().flat_map(|line| &line.parts).map(|part| part.group));
        assert!(found.stages.iter().all(|line| line.stage != "Register"), "stations stay where they are");
        if [col, row] == [66, 54] {
            println!("{found}");
        }
    }
    println!("groups {groups:?}, flags {flags:?}");
    for group in ["averaging", "scattering", "offset", "periodic", "position", "amplitude", "pixel width"] {
        assert!(groups.contains(group), "{group} in {groups:?}");
    }
    assert!(flags.len() >= 3, "{flags:?}");
}

#[test]
fn the_first_line_says_what_moved_the_pixel() {
    let (_folder, survey) = room();
    // Without a pipeline: all stages that level and calibration leave room for.
    let mut request = request(&survey, "0", [66, 54]);
    request.plan = None;
    let found = explain(&request, &Silent).unwrap();
    check_sums(&found);
    let names: Vec<&str> = found.stages.iter().map(|line| line.stage).collect();
    let all =
        "Demodulate Average Deconvolve Unwrap CorrectRange CorrectImagePoint Multipath FuseExposures PointCloud Flag";
    assert_eq!(names.join(" "), all);
    let text = found.to_string();
    let moved = text.lines().find(|line| line.starts_with("moved")).unwrap();
    assert!(moved.contains(" mm: ") && moved.contains("offset -10.0"), "{moved}");
    assert!(text.contains("periodic, wavelength U/4 (d6, d7)"), "{text}");
    // By its file it is the same frame.
    request.frame.clone_from(&found.file);
    assert_eq!(explain(&request, &Silent).unwrap().to_string(), text);
}

/// A wall two metres away at two frequencies, each with its own errors.
const TWO_FREQUENCIES: &str = "(
    scene: (objects: [(name: \"wall\", shape: Rectangle(corner_m: (-6.0, -5.0, 0.0), edge_u_m: (12.0, 0.0, 0.0),
        edge_v_m: (0.0, 10.0, 0.0)), albedo: 0.8)]),
    camera: (geometry: (format: (width: 16, height: 12, pixel_pitch_mm: (0.4, 0.4)),
        interior: (principal_point_mm: (0.0, 0.0), principal_distance_mm: 8.0)),
        modulation_hz: [25.0e6, 60.0e6], phase_steps: 4),
    illumination: (source_power: 8.0e6, modulation_contrast: 0.5, ambient_power: 5.0e4, vignetting_exponent: 1.0),
    exposure: (frames_per_station: 2, integration_time_s: 0.002, frame_interval_s: 0.1),
    stations: [(name: \"A\", position_m: (0.0, 0.0, 2.0),
        attitude: Euler(omega_deg: 0.0, phi_deg: 0.0, kappa_deg: 0.0))],
    errors: (
        range: [
            (ambiguity_interval_m: 5.99584916, terms: (d0: 0.010, periodic: (0.0, 0.0, 0.0, 0.0, 0.008, -0.005))),
            (ambiguity_interval_m: 2.498270483333333, terms: (d0: -0.004, periodic: (0.002, 0.001, 0.0, 0.0, 0.0, 0.0))),
        ],
        noise: (shot_variance_per_unit: 0.025, dark_sigma: 2.0),
    ),
)";

#[test]
fn with_several_frequencies_the_parts_are_those_of_the_weighted_mean() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.ron"), TWO_FREQUENCIES).unwrap();
    let source = SimulateSource {
        scene: "scene.ron".to_owned(),
        seed: 3,
        approximate_position_sigma_m: 0.0,
        approximate_attitude_sigma_deg: 0.0,
        gross_error_share: 0.0,
    };
    let survey = folder.path().join("survey");
    simulate(&source, folder.path(), &survey, &Silent).unwrap();
    let found = explain(&ExplainRequest { plan: None, ..request(&survey, "0", [9, 4]) }, &Silent).unwrap();
    println!("{found}");
    check_sums(&found);
    let part = |stage: &str, what: &str| {
        let line = found.stages.iter().find(|line| line.stage == stage).unwrap();
        line.parts.iter().find(|part| part.what.contains(what)).unwrap().change_m
    };
    // The weights of the two frequencies add up to one, so that the mean of d0 = 10 mm and -4 mm lies between.
    let offset = part("CorrectRange", "offset d0");
    assert!((-0.010..0.004).contains(&offset), "{offset}");
    assert!(part("Unwrap", "weighted mean of 2 frequencies").abs() < 0.05);
    assert!(part("CorrectRange", "other weights").abs() < 1e-3);
}

#[test]
fn what_is_wrong_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let survey = "(camera: (width: 4, height: 3, pixel_pitch_mm: (0.04, 0.04), principal_distance_mm: 8.0, \
                  principal_point_mm: (0.0, 0.0), modulation_hz: [30e6], phase_steps: 4), level: range, \
                  frames: [(file: \"a.npz\", station: \"S0\"), (file: \"b.npz\", station: \"S1\")])";
    std::fs::write(folder.path().join("survey.ron"), survey).unwrap();
    for file in ["a.npz", "b.npz"] {
        let mut writer = NpzWriter::create(folder.path().join(file)).unwrap();
        writer.add("range", &[3, 4], &[1.5_f32; 12]).unwrap();
        writer.commit().unwrap();
    }
    let ask = |frame: &str, pixel| {
        let plan = Plan::from_ron("(name: \"x\", stages: [Flag()])", Path::new("x.ron")).unwrap();
        let request = ExplainRequest { plan: Some(plan), ..request(folder.path(), frame, pixel) };
        explain(&request, &Silent)
    };
    let found = ask("b.npz", [3, 2]).unwrap();
    assert!(found.flags.is_empty());
    assert_eq!((found.range_m, found.moved_m), (Some(1.5), 0.0));
    assert!(found.to_string().contains("moved +0.0 mm: no stage changed it"), "{found}");
    let message = ask("7", [0, 0]).unwrap_err().to_string();
    assert!(message.contains("no frame `7`; the survey has 0: a.npz (S0), 1: b.npz (S1)"), "{message}");
    let message = ask("0", [4, 0]).unwrap_err().to_string();
    assert!(message.contains("pixel 4,0 is outside the image: columns run from 0 to 3, rows from 0 to 2"), "{message}");
    let ruled_out = explain(&request(folder.path(), "0", [0, 0]), &Silent).unwrap_err().to_string();
    assert!(ruled_out.contains("stage Demodulate is ruled out"), "{ruled_out}");
    // Without a pipeline the level chooses. The ranges are those of a ball about the camera, of which pixels see three micrometres.
    let free = ExplainRequest { plan: None, ..request(folder.path(), "0", [0, 0]) };
    let found = explain(&free, &Silent).unwrap();
    let names: Vec<&str> = found.stages.iter().map(|line| line.stage).collect();
    assert_eq!(names, ["Average", "Multipath", "FuseExposures", "PointCloud", "Flag"]);
    assert!((-5e-6..0.0).contains(&found.moved_m) && (found.range_m.unwrap() - 1.5).abs() < 5e-6, "{found}");
}

#[test]
fn cameras_of_short_intervals_and_few_pixels_are_explained_without_a_pipeline() {
    let folder = tempfile::tempdir().unwrap();
    // 60 and 80 MHz are unique within 7.5 m together, and twelve pixels are too few to compare frequencies by.
    let scene = TWO_FREQUENCIES
        .replace("modulation_hz: [25.0e6, 60.0e6]", "modulation_hz: [60.0e6, 80.0e6]")
        .replace("width: 16, height: 12", "width: 4, height: 3")
        .replace("5.99584916,", "2.498270483333333,")
        .replace(
            "ambiguity_interval_m: 2.498270483333333, terms: (d0: -0.004",
            "ambiguity_interval_m: 1.8737028625, terms: (d0: -0.004",
        );
    std::fs::write(folder.path().join("scene.ron"), scene).unwrap();
    let survey = common::simulated_from(&folder.path().join("scene.ron"), 3, folder.path());
    let found = explain(&ExplainRequest { plan: None, ..request(&survey, "0", [2, 1]) }, &Silent).unwrap();
    println!("{found}");
    check_sums(&found);
    // Two metres to the wall, seen nearly straight; noise of some millimetres.
    assert!((found.range_m.unwrap() - 2.0).abs() < 0.02, "{found}");
}
