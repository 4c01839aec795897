//! Noise estimated from repeated frames, against the truth of a simulation and on a real camera.

use std::path::{Path, PathBuf};

use pipeline::{DoubtKind, Judged, Plan, Silent, Verdict, ViewData, process};
use range_io::calibration::Calibration;
use tasks::{NoiseFitOptions, NoiseRequest, NoiseSummary, estimate_noise};

use crate::common::{fixtures, has_capture, simulated, simulated_with};

fn request(survey: PathBuf, out: &Path) -> NoiseRequest {
    NoiseRequest { survey, calibration: None, options: NoiseFitOptions::default(), out: out.to_owned() }
}

fn parameter<'a>(summary: &'a NoiseSummary, name: &str) -> &'a tasks::NoiseParameter {
    summary.parameters.iter().find(|parameter| parameter.name == name).unwrap()
}

#[test]
fn noise_of_samples_is_that_of_the_simulation() {
    let folder = tempfile::tempdir().unwrap();
    let survey = simulated("repeats", 1, folder.path());
    let out = folder.path().join("noise");
    let summary = estimate_noise(&request(survey.clone(), &out), &Silent).unwrap();
    println!("{summary}");
    let shot = parameter(&summary, "shot_variance_per_unit");
    assert!((shot.value - 0.25).abs() < 4.0 * shot.sigma, "{shot:?}");
    // Samples of 2.5 units are rounded: 25² + 2.5² / 12.
    let dark = parameter(&summary, "dark_sigma");
    assert!((dark.value - (625.0_f64 + 6.25 / 12.0).sqrt()).abs() < 4.0 * dark.sigma, "{dark:?}");
    assert!(parameter(&summary, "quantisation_sigma").held);
    assert!(summary.sigma_holds, "{}", summary.sigma_verdict);
    assert_eq!(summary.verdict(), Verdict::Done, "{summary}");
    let calibration = Calibration::read(&out).unwrap();
    assert_eq!(calibration.noise_parameters.len(), 3);
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(report.contains("Standard deviation against light") && report.contains("Standardised residuals"));

    // What was estimated is what demodulation gives to the pixels.
    let plan = Plan::from_ron("(name: \"sigma\", stages: [Demodulate()])", "sigma.ron".as_ref()).unwrap();
    let outcome = process(&plan, &survey, Some(&out), &Silent).unwrap();
    let ViewData::Phase(frame) = &outcome.views[0].data else { unreachable!("demodulated") };
    assert!(frame.channels[0].sigma.as_slice().iter().all(|sigma| *sigma > 0.0));
}

#[test]
fn four_frames_of_a_real_camera_tell_its_noise() {
    if !has_capture("sr4000_steps") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let survey = fixtures().join("surveys/sr4000_steps");
    let summary = estimate_noise(&request(survey, &folder.path().join("noise")), &Silent).unwrap();
    println!("{summary}");
    // This camera multiplies its amplitudes by the squared range, which nothing in the survey says.
    assert_eq!(summary.amplitude_scale, "times squared range");
    // Over a factor of twenty in light the line holds to what it states of itself: the misfit of variances, 15 %, is 8 % of
    // deviations, and no bin is off by more than twice that. The brightest pixels are quieter than a floor common to all
    // allows for: they are left out here.
    assert!(summary.misfit < 0.2, "{}", summary.misfit);
    let bins: Vec<_> = summary.bins.iter().filter(|bin| bin.light < 250.0).collect();
    assert!(bins.len() > 50, "{}", bins.len());
    for bin in bins {
        let ratio = bin.sigma_modelled / bin.sigma_observed;
        assert!((ratio - 1.0).abs() < summary.misfit, "{ratio} at an amplitude of {}", bin.light);
    }
    // The pixels' own scatter is 7 % beside what the line gives them, and the command says so.
    assert!((summary.sigma_ratio - 1.0).abs() < 0.1 && !summary.sigma_holds, "{}", summary.sigma_verdict);
    // No line goes through these variances: that is said, and in figures.
    assert!(summary.misfit_p_value < 1e-3, "{}", summary.misfit_p_value);
    let [doubt] = summary.doubts.as_slice() else { panic!("{:?}", summary.doubts) };
    assert_eq!((doubt.kind, summary.verdict()), (DoubtKind::Noise, Verdict::Doubtful));
    assert!(doubt.words.contains(&format!("{:.1} %", 100.0 * summary.misfit)), "{doubt}");
}

/// The survey of the SR4000 with these frames of each station only, and the lines of the camera changed.
fn frames_of_the_real_camera(keep: impl Fn(&str) -> bool, without_modulation: bool, folder: &Path) -> PathBuf {
    let text = std::fs::read_to_string(fixtures().join("surveys/sr4000_steps/survey.ron")).unwrap();
    let lines = text.lines().filter(|line| !line.contains("file:") || keep(line));
    let mut text = lines.collect::<Vec<_>>().join("\n").replace("../../../../shared", "shared");
    if without_modulation {
        text = text.replace("modulation_hz: [30e6]", "modulation_hz: []");
    }
    let survey = folder.join("survey");
    let captures = survey.join("shared/real/sr4000_steps");
    std::fs::create_dir_all(&captures).unwrap();
    for entry in std::fs::read_dir(fixtures().join("../../shared/real/sr4000_steps")).unwrap() {
        let entry = entry.unwrap();
        std::fs::copy(entry.path(), captures.join(entry.file_name())).unwrap();
    }
    std::fs::write(survey.join("survey.ron"), text).unwrap();
    survey
}

/// Which lines of a survey stay.
type Keep<'a> = &'a dyn Fn(&str) -> bool;

#[test]
fn pixels_that_a_camera_lost_do_not_tell_its_noise() {
    if !has_capture("sr4000_steps") {
        return;
    }
    let variants: [(&str, Keep<'_>, bool); 7] = [
        ("all", &|_| true, false),
        ("all, no modulation stated", &|_| true, true),
        ("Y1", &|line| line.contains("Y1"), false),
        ("Y2", &|line| line.contains("Y2"), false),
        ("three frames", &|line| !line.contains("_3.npz"), false),
        ("two frames", &|line| line.contains("_0.npz") || line.contains("_1.npz"), false),
        ("two frames, no modulation stated", &|line| line.contains("_2.npz") || line.contains("_3.npz"), true),
    ];
    for (name, keep, without_modulation) in variants {
        let folder = tempfile::tempdir().unwrap();
        let survey = frames_of_the_real_camera(keep, without_modulation, folder.path());
        let summary = estimate_noise(&request(survey, &folder.path().join("noise")), &Silent).unwrap();
        let (slope, floor) = (parameter(&summary, "sigma_times_amplitude_m"), parameter(&summary, "floor_m"));
        println!(
            "{name}: {} {} misfit {:.3} p {:.1e}",
            slope.value, floor.value, summary.misfit, summary.misfit_p_value
        );
        // One camera, one scene: the frames that were taken change the figures by what these leave open: a twentieth, of the
        // floor from two frames a fifth.
        let open = if name.starts_with("two frames") { 0.2 } else { 0.05 };
        assert!((slope.value / 2.9 - 1.0).abs() < 0.05, "{name}: {slope:?}");
        assert!((floor.value / 0.015 - 1.0).abs() < open, "{name}: {floor:?}");
    }
}

#[test]
fn a_single_frame_is_refused_with_its_reason() {
    let folder = tempfile::tempdir().unwrap();
    let survey = simulated_with("repeats", ["frames_per_station: 6", "frames_per_station: 1"], folder.path());
    let out = folder.path().join("noise");
    let error = estimate_noise(&request(survey, &out), &Silent).unwrap_err();
    assert!(matches!(error, pipeline::Error::Refused { .. }), "{error}");
    assert!(error.to_string().contains("has 1 frames, 2 are needed"), "{error}");
    let names = std::fs::read_dir(&out).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let names: Vec<String> = names.filter(|name| !name.starts_with('.')).collect();
    assert_eq!(names, ["summary.json"], "a refusal leaves its reasons and nothing that could be taken for a result");
}
