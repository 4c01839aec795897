//! Pipelines as data.

use std::path::Path;

use commands::plan::{Plan, Stage};
use commands::range_io::survey::Level;

const TEXT: &str = r#"(name: "scan", stages: [Demodulate(), Average(), Unwrap(), PointCloud()])"#;

fn read(text: &str) -> commands::Result<Plan> {
    Plan::from_ron(text, Path::new("scan.ron"))
}

#[test]
fn a_plan_is_read_and_checked_against_the_level_of_a_survey() {
    let plan = read(TEXT).unwrap();
    assert!(matches!(
        plan.stages[..],
        [Stage::Demodulate(_), Stage::Average(_), Stage::Unwrap(_), Stage::PointCloud(_)]
    ));
    plan.check_level(Level::Samples).unwrap();
    let error = plan.check_level(Level::Range).unwrap_err();
    assert!(error.to_string().contains("Demodulate"), "{error}");
}

#[test]
fn faults_are_named_with_file_and_field() {
    for (fault, replaced, expected) in [
        ("a stage that there is not", ("Unwrap(", "Unwarp("), "Unwarp"),
        ("an option that there is not", ("Average()", "Average(frame: 3)"), "frame"),
        ("a wrong order", ("Demodulate(), Average()", "Average(), Demodulate()"), "Demodulate"),
    ] {
        let error = read(&TEXT.replace(replaced.0, replaced.1)).unwrap_err().to_string();
        assert!(error.contains(expected), "{fault}: {error}");
    }
}
