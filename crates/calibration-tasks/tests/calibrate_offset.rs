//! The offset d0 as a constant, a look-up table and a surface: from planes into `calibration.ron`, and off the ranges.

use std::path::{Path, PathBuf};

use calibration_tasks::{CalibrationSummary, DiffRequest, OffsetModel, diff};
use pipeline::{Plan, Silent, ViewData, process};
use range_io::calibration::Calibration;
use tasks::{ExplainRequest, explain};

use crate::calibrate_planes::{camera, planes, ranges_to_wall, write_survey_with};
use crate::calibration_setup::{calibrate, changed, terms};

/// Half a centimetre of every pixel, up or down.
fn chequered([col, row]: [usize; 2]) -> f64 {
    0.005 * if (col * 7 + row * 3) % 4 < 2 { 1.0 } else { -1.0 }
}

/// Four centimetres in the corners, as steep as the square of the distance from the middle's square.
fn corners([col, row]: [usize; 2]) -> f64 {
    let (x, y) = ((col as f64 - 43.5) / 43.5, (row as f64 - 35.5) / 35.5);
    0.01 * (x * x + y * y).powi(2)
}

fn survey(folder: &Path, offset_m: impl Fn([usize; 2]) -> f64) {
    write_survey_with(&folder.join("survey"), |_| 0.0, offset_m);
}

/// Calibrates with this model of the offset and keeps the result under a name.
fn calibrated(folder: &Path, offset: OffsetModel, name: &str) -> (CalibrationSummary, PathBuf) {
    let summary = calibrate(folder, |request| {
        planes(request);
        request.offset = offset;
        if matches!(offset, OffsetModel::Surface { .. }) {
            request.options.terms = terms("d0 d2 d3 d4 d5 d6 d7");
        }
        request.out = folder.join(name);
    });
    (summary.unwrap(), folder.join(name))
}

/// Root mean square of the errors that a pipeline leaves of all ranges, metre.
fn rms(folder: &Path, calibration: &Path) -> f64 {
    let plan = Plan::from_ron("(name: \"x\", stages: [CorrectRange(), PointCloud()])", "x.ron".as_ref()).unwrap();
    let outcome = process(&plan, &folder.join("survey"), Some(calibration), &Silent).unwrap();
    let (mut squares, mut count) = (0.0, 0.0);
    for view in &outcome.views {
        let ViewData::Range(frame) = &view.data else { panic!("ranges are ranges") };
        let truth = ranges_to_wall(&camera(), &view.approximate_world_from_camera.unwrap());
        for (range, truth) in frame.range.as_slice().iter().zip(truth) {
            squares += (f64::from(*range) - truth).powi(2);
            count += 1.0;
        }
    }
    f64::sqrt(squares / count)
}

#[test]
fn a_table_takes_off_what_a_constant_leaves() {
    let folder = tempfile::tempdir().unwrap();
    survey(folder.path(), chequered);
    let (plain, constant) = calibrated(folder.path(), OffsetModel::Constant, "constant");
    assert!(plain.offset_table.is_none() && Calibration::read(&constant).unwrap().fixed_pattern.is_none());
    let (summary, table) = calibrated(folder.path(), OffsetModel::Table { block: 1 }, "table");
    println!("{summary}");
    let found = summary.offset_table.as_ref().unwrap();
    assert!(found.applied && found.known_blocks == 88 * 72, "{found:?}");
    // The sines that stand for noise leave 0.65 mm of a mean of seven frames.
    assert!((found.offset_rms_m - 0.005).abs() < 4e-4 && found.deviation_rms_m < 1.5e-3, "{found:?}");
    let pattern = Calibration::read(&table).unwrap().fixed_pattern.unwrap();
    let mean = pattern.offset_m.iter().map(|offset| f64::from(*offset)).sum::<f64>() / pattern.offset_m.len() as f64;
    // d0 is from a quarter of the pixels: 5 mm over the root of 1584 of them, four times.
    assert!(mean.abs() < 5e-4, "{mean}");
    let (left, taken) = (rms(folder.path(), &constant), rms(folder.path(), &table));
    println!("{:.2} mm with a constant, {:.2} mm with the table", 1e3 * left, 1e3 * taken);
    // Noise of 3 mm, with 5 mm beside it and without; the frames are those that the table is from.
    assert!((left - 5.83e-3).abs() < 3e-4 && taken < 3.1e-3, "{left} {taken}");
    let report = std::fs::read_to_string(table.join("report.html")).unwrap();
    assert!(report.contains("The offset of each pixel") && report.contains("the table is part of the calibration"));

    let request = ExplainRequest {
        survey: folder.path().join("survey"),
        frame: "3".to_owned(),
        pixel: [20, 31],
        plan: None,
        calibration: Some(table.clone()),
    };
    let words = explain(&request, &Silent).unwrap().to_string();
    assert!(words.contains("fixed pattern of the pixel"), "{words}");

    let compare = |first: &Path, second: &Path| {
        diff(&DiffRequest { first: first.to_owned(), second: second.to_owned(), level: 0.01 }).unwrap()
    };
    let alone = compare(&constant, &table);
    assert!(alone.only_second.iter().any(|name| name.contains("table of offsets")) && alone.pattern.is_none());
    let same = compare(&table, &table);
    assert!(!same.significant && same.pattern.as_ref().unwrap().pixels == 88 * 72, "{same}");
    let mut moved = Calibration::read(&table).unwrap();
    moved.fixed_pattern.as_mut().unwrap().offset_m[5 * 88 + 17] += 0.02;
    moved.write(folder.path().join("moved.ron")).unwrap();
    let other = compare(&table, &folder.path().join("moved.ron"));
    let line = other.pattern.as_ref().unwrap();
    println!("{other}");
    assert!((line.largest_m - 0.02).abs() < 1e-6 && line.pixel == [17, 5], "{line:?}");
    assert!(other.to_string().contains("offsets of 6336 pixels: differ by up to +20.00 mm"));
}

#[test]
fn what_is_not_there_gets_no_table() {
    let folder = tempfile::tempdir().unwrap();
    survey(folder.path(), |_| 0.0);
    let (summary, out) = calibrated(folder.path(), OffsetModel::Table { block: 12 }, "table");
    let found = summary.offset_table.as_ref().unwrap();
    // 8 x 6 blocks, the last column of them narrower.
    assert!(!found.applied && found.known_blocks == 48 && found.block_px == 12, "{found:?}");
    assert!(Calibration::read(&out).unwrap().fixed_pattern.is_none());
    assert!(summary.to_string().contains("no more than by chance"), "{summary}");
}

#[test]
fn a_surface_takes_off_what_grows_towards_the_corners() {
    let folder = tempfile::tempdir().unwrap();
    survey(folder.path(), corners);
    let (_, constant) = calibrated(folder.path(), OffsetModel::Constant, "constant");
    let (summary, surface) = calibrated(folder.path(), OffsetModel::Surface { order: 4 }, "surface");
    println!("{summary}");
    let (left, taken) = (rms(folder.path(), &constant), rms(folder.path(), &surface));
    println!("{:.2} mm with a constant, {:.2} mm with the surface", 1e3 * left, 1e3 * taken);
    // The surface of order four is exactly of this kind: noise of 3 mm is left.
    assert!(left > 5e-3 && (taken - 3e-3).abs() < 1e-4, "{left} {taken}");
    let g20 = summary.parameters.get("g20").unwrap();
    assert!(g20.status == "estimated" && g20.sigma_posterior < 1e-3, "{g20:?}");
    let correlation = Calibration::read(&surface).unwrap().correlation.unwrap();
    assert!(correlation.names.contains(&"g04".to_owned()), "{:?}", correlation.names);
}

#[test]
fn what_excludes_a_surface_or_a_table_is_named() {
    let folder = tempfile::tempdir().unwrap();
    survey(folder.path(), |_| 0.0);
    let refused = calibrate(folder.path(), |request| {
        planes(request);
        request.offset = OffsetModel::Surface { order: 2 };
    });
    let message = refused.unwrap_err().to_string();
    assert!(message.contains("`e1` and `surface2`") && message.contains("keep one"), "{message}");
    let targets = changed(|_| ());
    let refused = calibrate(targets.path(), |request| request.offset = OffsetModel::Table { block: 1 });
    let message = refused.unwrap_err().to_string();
    assert!(message.contains("--method planes") && message.contains("`surface2`"), "{message}");
}
