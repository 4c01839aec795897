//! Networks with something wrong in their tables: a single gross error is rejected with its line and the result stands,
//! a whole column or station is refused by its cause.

use std::path::Path;

use calibration_tasks::CalibrationSummary;
use pipeline::{Error, Failure, Judged, Verdict};
use range_io::calibration::Calibration;

use crate::calibration_setup::{calibrate, changed};

/// Columns of `observations.csv`.
const STATION: usize = 0;
const TARGET: usize = 1;
const COL: usize = 2;
const ROW: usize = 3;
const RANGE: usize = 4;

/// Half the speed of light over 20 MHz, metre.
const INTERVAL: f64 = 7.494_811_45;

/// Rewrites the rows of `observations.csv`; `change` gets the line and the fields.
fn rewrite(survey: &Path, change: impl Fn(usize, &mut Vec<String>)) {
    let file = survey.join("observations.csv");
    let text = std::fs::read_to_string(&file).unwrap();
    let row = |(index, line): (usize, &str)| {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        if index > 0 {
            change(index + 1, &mut fields);
        }
        fields.join(",") + "\n"
    };
    std::fs::write(&file, text.lines().enumerate().map(row).collect::<String>()).unwrap();
}

fn number(fields: &mut [String], column: usize, change: impl Fn(f64) -> f64) {
    if !fields[column].is_empty() {
        fields[column] = change(fields[column].parse().unwrap()).to_string();
    }
}

fn answer(change: impl Fn(usize, &mut Vec<String>)) -> pipeline::Result<CalibrationSummary> {
    let folder = changed(|survey| rewrite(survey, change));
    let summary = calibrate(folder.path(), |_| {})?;
    let truth = Calibration::read(folder.path().join("survey/truth/calibration.ron")).unwrap();
    for known in truth.parameters.iter().chain(&truth.range_models[0].parameters) {
        let found = summary.parameters.get(&known.name).unwrap();
        let off = (found.value - known.value).abs();
        assert!(found.status != "estimated" || off < 4.0 * found.sigma_prior, "{}: {off}", known.name);
    }
    Ok(summary)
}

/// What is said, and what kind of failure it is.
fn refusal(change: impl Fn(usize, &mut Vec<String>)) -> (String, Failure) {
    let error: Error = answer(change).unwrap_err();
    (error.to_string(), error.failure())
}

/// A fault that is put into the fields of a line.
type Spoil<'a> = &'a dyn Fn(usize, &mut Vec<String>);

#[test]
fn one_gross_error_is_rejected_with_its_line() {
    let wrap = |line: usize, fields: &mut Vec<String>| {
        if line == 40 {
            number(fields, RANGE, |range| range + INTERVAL);
        }
    };
    let far = |line: usize, fields: &mut Vec<String>| {
        if line == 90 {
            number(fields, COL, |col| if col < 75.0 { col + 100.0 } else { col - 70.0 });
        }
    };
    let millimetres = |line: usize, fields: &mut Vec<String>| {
        if line == 120 {
            number(fields, RANGE, |range| 1e3 * range);
        }
    };
    let cases: [(usize, &str, &str, Spoil<'_>); 3] = [
        (40, "range", "one ambiguity interval too long", &wrap),
        (90, "col", "", &far),
        (120, "range", "millimetres", &millimetres),
    ];
    for (line, component, words, change) in cases {
        let summary = answer(change).unwrap();
        assert_eq!(summary.verdict(), Verdict::Done, "{:?}", summary.doubts());
        let named = summary.rejected.iter().any(|gross| gross.line == Some(line) && gross.component == component);
        assert!(named, "line {line}: {:?}", summary.rejected);
        let said = summary.diagnosis.join("; ");
        assert!(said.contains(words), "{said}");
        // A share of 0.002 of 1,986 values was wrong before.
        assert!(summary.rejected.len() < 24, "{:?}", summary.rejected);
    }
}

#[test]
fn two_names_exchanged_are_told() {
    let summary = answer(|line, fields| match line {
        200 => fields[TARGET] = at(210, TARGET),
        210 => fields[TARGET] = at(200, TARGET),
        _ => {}
    })
    .unwrap();
    let said = summary.diagnosis.join("; ");
    assert!(
        said.contains("names exchanged") && said.contains(&at(200, TARGET)) && said.contains(&at(210, TARGET)),
        "{said}"
    );
    assert_eq!(summary.verdict(), Verdict::Done, "{:?}", summary.doubts());
}

/// A field of a line of the sound survey.
fn at(line: usize, column: usize) -> String {
    let text = std::fs::read_to_string(crate::calibration_setup::target_field().join("observations.csv")).unwrap();
    text.lines().nth(line - 1).unwrap().split(',').nth(column).unwrap().to_owned()
}

#[test]
fn an_image_point_outside_the_image_is_refused_with_its_line() {
    let (said, failure) = refusal(|line, fields| {
        if line == 17 {
            number(fields, ROW, |_| 150.0);
        }
    });
    assert!(said.contains("observations.csv:17:4: `row`") && said.contains("is 150"), "{said}");
    assert_eq!(failure, Failure::Usage);
}

#[test]
fn a_wrong_unit_of_all_is_wrong_input() {
    let (said, failure) = refusal(|_, fields| number(fields, RANGE, |range| 1e3 * range));
    assert!(said.contains("the ranges fit if they are millimetres"), "{said}");
    assert_eq!(failure, Failure::Usage);
}

#[test]
fn a_station_that_contradicts_is_refused_by_its_cause() {
    let (said, failure) = refusal(|_, fields| {
        if fields[STATION] == "F04" {
            number(fields, RANGE, |range| range + INTERVAL);
        }
    });
    assert!(said.contains("station `F04`") && said.contains("ambiguity interval"), "{said}");
    assert_eq!(failure, Failure::Refused);
}

#[test]
fn what_nothing_explains_is_named_by_its_row() {
    // Every station has its targets in another order.
    let (said, failure) = refusal(|line, fields| fields[TARGET] = format!("T{:03}", 1 + (line * 37) % 63));
    assert!(said.contains("no known cause explains it") && said.contains("observations.csv, line"), "{said}");
    assert_eq!(failure, Failure::Refused, "{said}");
}
