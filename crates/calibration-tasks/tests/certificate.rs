//! What a laboratory signs: each item of the certificate, where it comes from, and what does not depend on the day.

use std::collections::BTreeSet;
use std::path::Path;

use calibration_tasks::{CalibrationSummary, HeldOut, HeldOutCheck};
use pipeline::{Plan, Silent, process};
use range_image::NoiseModel;
use range_io::calibration::Calibration;
use range_io::tables::read_residuals;
use serde_json::Value;
use sha2::{Digest, Sha256};

use crate::calibration_setup::{calibrate, changed, edit, request, target_field, terms};
use crate::common::{fixtures, simulated};

/// Terms of the room's network.
const ROOM: &str = "xp yp c k1 k2 p1 p2 d0 d2 d3 d4 d5 d6 d7 e1 e2 h1 h2 h3";
const DATE: &str = "2026-01-02";

/// The fixture with everything that a survey can say of camera and operator.
fn identified() -> tempfile::TempDir {
    changed(|survey| {
        let given = "level: range,\n    camera_identity: \"Example TOF-1 <no. 17>\", firmware: \"2.4.1\", operator: \"A. Gauss\",";
        edit(&survey.join("survey.ron"), "level: range,", given);
    })
}

fn certified(folder: &Path, out: &str, hold_out: Option<usize>, date: &str) -> CalibrationSummary {
    let mut request = request(&folder.join("survey"), &folder.join(out));
    request.certificate.date = Some(date.to_owned());
    request.certificate.hold_out = hold_out;
    calibration_tasks::calibrate(&request, &Silent).unwrap()
}

/// Equal to what two ways of writing and reading decimals leave: units in the last place.
fn assert_same(a: Option<f64>, b: Option<f64>, name: &str) {
    let same = match (a, b) {
        (Some(a), Some(b)) => (a / b - 1.0).abs() < 1e-14,
        (a, b) => a == b,
    };
    assert!(same, "{name}: {a:?} {b:?}");
}

fn read(folder: &Path, file: &str) -> String {
    std::fs::read_to_string(folder.join(file)).unwrap()
}

#[test]
fn a_certificate_has_each_item_and_its_figures_are_those_of_the_files() {
    let folder = identified();
    certified(folder.path(), "out", Some(4), DATE);
    let out = folder.path().join("out");
    let json: Value = serde_json::from_str(&read(&out, "summary.json")).unwrap();
    let certificate = &json["certificate"];
    let page = read(&out, "certificate.html");
    let report = read(&out, "report.html");
    let version = format!("rangecam {}", env!("CARGO_PKG_VERSION"));
    for words in ["Example TOF-1 &lt;no. 17&gt;", "2.4.1", "A. Gauss", &version, "0.004 s", "not given", "k = 2"] {
        assert!(page.contains(words), "the certificate has no {words:?}");
        assert!(report.contains(words), "the report has no {words:?}");
    }
    assert!(page.contains(DATE) && !report.contains(DATE), "the date stands on the certificate alone");
    assert!(page.contains("@page{size:A4") && !page.contains("NaN") && !page.contains("src="));
    assert!(read(&out, ".complete").lines().any(|line| line == "certificate.html"));

    // Digests of all files that were read, and of no others.
    let inputs = certificate["inputs"].as_array().unwrap();
    let names: BTreeSet<&str> =
        inputs.iter().map(|input| input["file"].as_str().unwrap().rsplit('/').next().unwrap()).collect();
    assert_eq!(names, ["survey.ron", "observations.csv", "stations.csv", "targets.csv", "distances.csv"].into());
    for input in inputs {
        let bytes = std::fs::read(input["file"].as_str().unwrap()).unwrap();
        let digest = format!("{:x}", Sha256::digest(&bytes));
        assert_eq!(input["sha256"], digest.as_str());
        assert_eq!(input["bytes"], bytes.len());
        assert!(page.contains(&digest));
    }

    // Verdicts can be traced to the rows that they name.
    let rows = read_residuals(out.join("residuals.csv")).unwrap();
    let verdicts = certificate["verdicts"].as_array().unwrap();
    let of = |test: &str| {
        verdicts.iter().find(|verdict| verdict["test"] == test).unwrap_or_else(|| panic!("{test}: {verdicts:#?}"))
    };
    let used = || rows.iter().filter(|row| ["used", "uncontrolled"].contains(&row.verdict.as_str()));
    let whole = of("standard deviations of all observations");
    assert_eq!(whole["passed"], true);
    assert!(whole["rows"].as_str().unwrap().starts_with(&format!("{} rows", used().count())), "{whole}");
    let sum: f64 = used().map(|row| (row.residual.unwrap() / row.sigma.unwrap()).powi(2)).sum();
    let vtpv = json["vtpv"].as_f64().unwrap();
    // Residuals are written with all their digits.
    assert!((sum / vtpv - 1.0).abs() < 1e-9, "{sum} {vtpv}");
    let gross = of("gross errors")["rows"].as_str().unwrap();
    let lines: Vec<usize> =
        gross.split("lines ").nth(1).unwrap().split(", ").map(|line| line.parse().unwrap()).collect();
    let text = read(&out, "residuals.csv");
    let text: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), json["rejected"].as_array().unwrap().len());
    assert!(lines.iter().all(|line| text[line - 1].ends_with(",rejected")), "{lines:?}");
    assert!(of("significance: principal point")["words"].as_str().unwrap().contains("differ from zero"));

    // Stations and targets with their deviations and detectable errors.
    for (list, name, count) in [("stations", "station", 14), ("targets", "target", 63)] {
        let entries = certificate[list].as_array().unwrap();
        assert_eq!(entries.len(), count);
        for entry in entries {
            let name = entry[name].as_str().unwrap();
            assert!(page.contains(&format!("<td class=\"w\">{name}</td>")), "{name} is not on the page");
            let own = |component: &[&str]| {
                let own = rows
                    .iter()
                    .filter(|row| row.verdict == "used" && [&row.station, &row.target].iter().any(|n| *n == name));
                let sizes = own
                    .filter(|row| component.contains(&row.component.as_str()))
                    .filter_map(|row| row.smallest_detectable);
                sizes.reduce(f64::max)
            };
            assert_same(entry["detectable_px"].as_f64(), own(&["col", "row"]), name);
            assert_same(entry["detectable_range_m"].as_f64(), own(&["range"]), name);
        }
    }
    let pairs = certificate["notorious_pairs"].as_array().unwrap();
    let correlation = Calibration::read(&out).unwrap().correlation.unwrap();
    for pair in pairs {
        let [a, b] = ["first", "second"].map(|end| pair[end].as_str().unwrap());
        let written = correlation.between(a, b).unwrap();
        assert!((pair["correlation"].as_f64().unwrap() - written).abs() < 1e-12, "{a} {b}");
    }
    assert!(pairs.iter().any(|pair| pair["first"] == "xp" && pair["second"] == "p1"));

    // Nine places; the centre is known better than the corner.
    let places = certificate["expanded_uncertainty"].as_array().unwrap();
    assert_eq!(places.len(), 9);
    for three in places.chunks(3) {
        let [centre, corner] = [&three[0], &three[2]].map(|place| place["point_by_calibration_m"].as_f64().unwrap());
        assert!(0.0 < centre && centre < corner && corner < 0.1, "{three:?}");
    }
    assert!(certificate["span"][0].as_str().unwrap().starts_with("ranges of"), "{}", certificate["span"]);
    assert!(certificate["hold_out"]["made"]["image"]["fails"] == false, "{}", certificate["hold_out"]);
}

#[test]
fn the_day_changes_the_certificate_in_one_place_and_nothing_else() {
    let folder = identified();
    for (out, date) in [("a", DATE), ("b", DATE), ("c", "2031-12-30")] {
        certified(folder.path(), out, None, date);
    }
    let [a, b, c] = ["a", "b", "c"].map(|out| folder.path().join(out));
    for file in ["certificate.html", "report.html", "calibration.ron", "residuals.csv"] {
        assert!(read(&a, file) == read(&b, file), "{file}");
    }
    assert_eq!(read(&c, "certificate.html").replace("2031-12-30", DATE), read(&a, "certificate.html"));
    assert!(read(&a, "report.html") == read(&c, "report.html"));
    assert!(read(&a, "certificate.html").contains("not made: not asked for"));
    // The command line's operator wins.
    let mut other = request(&folder.path().join("survey"), &folder.path().join("d"));
    other.certificate.operator = Some("B. Bessel".to_owned());
    calibration_tasks::calibrate(&other, &Silent).unwrap();
    let page = read(&folder.path().join("d"), "certificate.html");
    assert!(page.contains("B. Bessel") && !page.contains("A. Gauss"));
}

/// A network like the fixture's with another lens, seed and half the gross errors.
fn held_out(k1: &str, seed: u64, list: &str, hold_out: usize) -> (CalibrationSummary, HeldOutCheck) {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("network.ron");
    std::fs::copy(fixtures().join("networks/target_field.ron"), &scene).unwrap();
    edit(&scene, "\"k1\": -1.5e-3, \"k2\": 2e-5", &format!("\"k1\": {k1}"));
    calibration_tasks::simulate_network(&scene, Some(seed), &folder.path().join("survey")).unwrap();
    let summary = calibrate(folder.path(), |request| {
        request.options.terms = terms(list);
        request.certificate.hold_out = Some(hold_out);
    })
    .unwrap();
    let HeldOut::Made(check) = summary.certificate.clone().unwrap().hold_out else {
        panic!("{:?}", summary.certificate.unwrap().hold_out)
    };
    (summary, *check)
}

#[test]
fn left_out_stations_are_predicted_by_a_sound_calibration_and_not_by_one_that_lacks_a_term() {
    for (seed, every) in [(11, 4), (12, 3), (13, 5)] {
        let (summary, check) = held_out("-1.5e-3", seed, "xp yp c k1 p1 p2 d0 d4 d5 d6 d7 e1 e2", every);
        assert!(summary.doubts.is_empty() && !check.image.fails, "{:?}", summary.doubts);
        assert_eq!(check.stations.len(), 14 / every);
        let range = check.range.unwrap();
        // As said in the scene: 0.05 px and 10 mm, poses of the image points and calibration on top.
        assert!((0.04..0.075).contains(&check.image.rms), "{}", check.image.rms);
        assert!(!range.fails && (0.008..0.016).contains(&range.rms), "{}", range.rms);
    }
    let (summary, check) = held_out("-1.5e-3", 11, "xp yp c p1 p2 d0 d4 d5 d6 d7 e1 e2", 4);
    assert!(check.image.fails, "{check:?}");
    assert!(summary.doubts.iter().any(|doubt| doubt.words.contains("left out")), "{:?}", summary.doubts);
}

#[test]
fn noise_and_scattering_of_an_earlier_file_are_taken_along_and_what_is_not_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let mut earlier = Calibration::read(target_field().join("truth")).unwrap();
    earlier.noise = Some(NoiseModel { shot_variance_per_unit: 0.25, dark_sigma: 4.0 });
    let psf = Calibration::read(simulated("room_small", 1, folder.path())).unwrap().scattering;
    assert!(psf.is_some());
    earlier.scattering = psf;
    earlier.range_models[0].integration_time_s = 0.002;
    let file = folder.path().join("earlier.ron");
    earlier.write(&file).unwrap();
    let mut request = request(&target_field(), &folder.path().join("out"));
    request.calibration = Some(file);
    let summary = calibration_tasks::calibrate(&request, &Silent).unwrap();
    let new = Calibration::read(&request.out).unwrap();
    assert_eq!((new.noise, new.scattering), (earlier.noise, earlier.scattering));
    assert_eq!(summary.taken_over, ["noise", "scattering"]);
    let said = summary.diagnosis.join("\n");
    for words in ["taken over from", "noise of the samples, scattering", "range terms of 0.002 s at 20 MHz stay behind"]
    {
        assert!(said.contains(words), "{said}");
    }
    let inputs = summary.certificate.unwrap().inputs;
    assert!(inputs.iter().any(|input| input.file.ends_with("earlier.ron")), "{inputs:?}");
}

#[test]
fn a_network_without_integration_times_says_what_to_do_before_and_when_it_is_used() {
    let folder = tempfile::tempdir().unwrap();
    let network = folder.path().join("survey");
    calibration_tasks::simulate_network(&fixtures().join("networks/room_small.ron"), None, &network).unwrap();
    let file = network.join("observations.csv");
    let text = std::fs::read_to_string(&file).unwrap();
    assert!(text.lines().next().unwrap().ends_with(",integration_time_s"));
    let cut: Vec<&str> = text.lines().map(|line| line.rsplit_once(',').unwrap().0).collect();
    std::fs::write(&file, cut.join("\n") + "\n").unwrap();
    let summary = calibrate(folder.path(), |request| request.options.terms = terms(ROOM)).unwrap();
    let said = summary.diagnosis.join("\n");
    for words in ["survey.ron", "integration_time_s", "(0 frames)", "--integration-time"] {
        assert!(said.contains(words), "{said}");
    }
    assert!(summary.doubts.is_empty(), "it is right for frames that state no time");

    // A survey of the same camera whose frames state a time.
    let survey = simulated("room_small", 1, folder.path());
    let plan = Plan::from_ron(
        "(name: \"m\", stages: [Demodulate(low_amplitude: 20), Unwrap(), CorrectRange()])",
        Path::new("m.ron"),
    )
    .unwrap();
    let refused =
        |file: &Path| process(&plan, &survey, Some(file), &Silent).map(|_| ()).map_err(|error| error.to_string());
    let words = refused(&folder.path().join("out/calibration.ron")).unwrap_err();
    for part in ["survey.ron", "integration_time_s", "stand-in", "calibrate --integration-time 0.002"] {
        assert!(words.contains(part), "{words}");
    }
    // What the message says helps.
    calibrate(folder.path(), |request| {
        request.options.terms = terms(ROOM);
        request.defaults.integration_time_s = Some(0.002);
    })
    .unwrap();
    refused(&folder.path().join("out/calibration.ron")).unwrap();
}

#[test]
fn pages_of_large_networks_stay_small() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("large.ron");
    let text = std::fs::read_to_string(fixtures().join("networks/target_field.ron")).unwrap();
    let (head, tail) = text.split_once("    stations: [").unwrap();
    let (_, tail) = tail.split_once("\n    ],").unwrap();
    let head = head.replace("columns: 9, rows: 7, spacing_m: 0.3", "columns: 20, rows: 14, spacing_m: 0.14");
    let station = |k: usize| {
        let (distance, roll, side) = (
            1.4 + 0.04 * k as f64,
            90 * (k % 4),
            if k.is_multiple_of(2) { 0.0 } else { 60.0 * (k % 8) as f64 / 7.0 - 30.0 },
        );
        format!(
            "(name: \"Station {k:03}\", distance_m: {distance}, aside_deg: {side}, above_deg: {}, roll_deg: {roll}, integration_time_s: 0.004)",
            -0.7 * side
        )
    };
    let stations: Vec<String> = (0..60).map(station).collect();
    std::fs::write(&scene, format!("{head}    stations: [{}],{tail}", stations.join(","))).unwrap();
    calibration_tasks::simulate_network(&scene, None, &folder.path().join("survey")).unwrap();
    calibrate(folder.path(), |_| {}).unwrap();
    let out = folder.path().join("out");
    let rows = read_residuals(out.join("residuals.csv")).unwrap().len();
    assert!(rows > 25_000, "{rows} values");
    let report = read(&out, "report.html");
    // Figures no longer grow with the observations; with an arrow and five dots for each it was 1.7 million bytes.
    assert!(report.len() < 1_000_000, "{} bytes", report.len());
    for words in ["30 of 60 stations", "The darker, the more values", "Mean residuals of the image points in each"] {
        assert!(report.contains(words), "the report does not say {words:?}");
    }
    labels_do_not_overlap(&report);
}

/// Names of stations in a figure, as rectangles of at most 6 x 10 pixels for each character.
fn labels_do_not_overlap(report: &str) {
    let mut figures = 0;
    for svg in report.split("<svg").filter(|svg| svg.contains(">From ")) {
        let svg = svg.split("</svg>").next().unwrap();
        let number = |text: &str, key: &str| -> f64 {
            text.split(&format!("{key}=\"")).nth(1).unwrap().split('"').next().unwrap().parse().unwrap()
        };
        let mut boxes: Vec<[f64; 4]> = Vec::new();
        for text in svg.split("<text ").filter(|text| text.contains(">Station ")) {
            let name = text.split('>').nth(1).unwrap().split('<').next().unwrap();
            let width = 6.0 * name.len() as f64;
            let (x, y) = (number(text, "x"), number(text, "y"));
            let left = if text.contains("\"end\"") { x - width } else { x };
            boxes.push([left, y - 10.0, left + width, y]);
        }
        figures += 1;
        assert!(boxes.len() > 3, "{} names", boxes.len());
        for (k, [l, t, r, b]) in boxes.iter().enumerate() {
            assert!(
                boxes[..k].iter().all(|o| l >= &o[2] || r <= &o[0] || t >= &o[3] || b <= &o[1]),
                "name {k} runs over another"
            );
        }
    }
    assert_eq!(figures, 2);
}
