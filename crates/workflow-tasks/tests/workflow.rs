//! Workflows as they are written.

use std::fs;
use std::path::Path;

use workflow_tasks::commands::{Error, Judged, Verdict};
use workflow_tasks::{WorkflowRequest, write_workflow};

const PLAN: &str = "(name: \"p\", stages: [Average(), PointCloud(), Flag()])";

fn archive(root: &Path, folders: &[&str], plan: &str) -> WorkflowRequest {
    let archive = root.join("archive");
    for folder in folders {
        fs::create_dir_all(archive.join(folder)).unwrap();
    }
    fs::write(archive.join("pipeline.ron"), plan).unwrap();
    WorkflowRequest { archive, pipeline: None, shards: 3, threads: 2, out: root.join("flow") }
}

const FOLDERS: [&str; 7] = [
    "a/calibration",
    "a/2026-05-04/check",
    "a/2026-05-04/hall",
    "a/2026-05-04/yard",
    "a/2026-05-05/hall",
    "b/2026-05-04/warmup",
    "b/2026-05-04/hall",
];

#[test]
fn the_configuration_lists_what_the_archive_holds() {
    let root = tempfile::tempdir().unwrap();
    let request = archive(root.path(), &FOLDERS, PLAN);
    fs::write(request.archive.join("a/calibration/planes.csv"), "").unwrap();
    fs::create_dir(request.archive.join(".hidden")).unwrap();
    let summary = write_workflow(&request).unwrap();
    assert_eq!((summary.cameras, summary.days, summary.recordings, summary.shards), (2, 3, 4, 3));
    // One calibration, a check, a drift, four times three parts and their merge, the report.
    assert_eq!(summary.jobs, 1 + 2 + 4 * 4 + 1);
    assert_eq!(summary.verdict(), Verdict::Done);
    let config = fs::read_to_string(request.out.join("config.yaml")).unwrap();
    let cameras = config.split_once("cameras:\n").unwrap().1;
    let expected = r#"  "a":
    calibration: survey
    calibrate_options: "--method planes"
    days:
      "2026-05-04":
        check: true
        warmup: false
        recordings: ["hall", "yard"]
      "2026-05-05":
        check: false
        warmup: false
        recordings: ["hall"]
  "b":
    calibration: recordings
    calibrate_options: ""
    days:
      "2026-05-04":
        check: false
        warmup: true
        recordings: ["hall"]
"#;
    assert_eq!(cameras, expected);
    assert!(config.contains("shards: 3 ") && config.contains("threads: 2 "), "{config}");
    assert_eq!(fs::read_to_string(request.out.join("pipeline.ron")).unwrap(), PLAN);
    // Again over itself.
    write_workflow(&request).unwrap();
}

/// Brackets and quotes close, every rule has an output, and what a rule names is there.
#[test]
fn the_snakefile_holds_together() {
    let root = tempfile::tempdir().unwrap();
    let request = archive(root.path(), &FOLDERS, PLAN);
    write_workflow(&request).unwrap();
    let text = fs::read_to_string(request.out.join("Snakefile")).unwrap();
    assert_eq!(depth_at_the_end(&text), 0);
    let rules: Vec<&str> = text.split("\nrule ").flat_map(|part| part.split("    rule ")).skip(1).collect();
    let names: Vec<&str> = rules.iter().map(|rule| rule.split(':').next().unwrap()).collect();
    assert_eq!(names, ["all", "calibrate", "check", "warmup", "recording", "part", "merge", "tidy", "fleet"]);
    for rule in &rules[1..] {
        let name = rule.split(':').next().unwrap();
        assert!(rule.contains("output:") && rule.contains("shell:"), "{name}");
        for part in rule.split("{params.").skip(1) {
            let parameter = part.split('}').next().unwrap();
            assert!(rule.contains(&format!("{parameter}=")), "{name}: {parameter}");
        }
    }
    let config = fs::read_to_string(request.out.join("config.yaml")).unwrap();
    for name in text.split("config[\"").skip(1).chain(text.split("config['").skip(1)) {
        let name = name.split(['"', '\'']).next().unwrap();
        assert!(config.contains(&format!("\n{name}:")), "{name}");
    }
}

fn depth_at_the_end(text: &str) -> i32 {
    let code = text.lines().map(|line| line.split(" # ").next().unwrap()).filter(|line| !line.starts_with('#'));
    let (mut depth, mut quote) = (0, None);
    for line in code {
        for c in line.chars() {
            match (quote, c) {
                (None, '"' | '\'') => quote = Some(c),
                (Some(open), c) if c == open => quote = None,
                (None, '(' | '[' | '{') => depth += 1,
                (None, ')' | ']' | '}') => depth -= 1,
                _ => {}
            }
        }
        assert_eq!(quote, None, "{line}");
    }
    depth
}

#[test]
fn stations_that_are_joined_are_one_job() {
    let root = tempfile::tempdir().unwrap();
    let request = archive(root.path(), &["a/d/r"], "(name: \"p\", stages: [PointCloud(), Register()])");
    let summary = write_workflow(&request).unwrap();
    assert_eq!((summary.shards, summary.jobs, summary.doubts.len()), (1, 2, 1));
    assert!(summary.doubts[0].words.contains("Register"));
}

#[test]
fn archives_that_can_be_no_workflow_are_refused() {
    let root = tempfile::tempdir().unwrap();
    let refused = |request: &WorkflowRequest| match write_workflow(request) {
        Err(Error::Request { message, .. }) => message,
        other => format!("{other:?}"),
    };
    let mut request = archive(root.path(), &["a/calibration", "b/2026"], PLAN);
    assert!(refused(&request).contains("holds no recording"), "{}", refused(&request));
    fs::create_dir_all(request.archive.join("a/day one/hall")).unwrap();
    assert!(refused(&request).contains("day one"));
    request.shards = 0;
    assert!(refused(&request).contains("--shards is 0"));
    // Nothing is written into what is read.
    let inside = WorkflowRequest { out: request.archive.join("flow"), shards: 2, ..request };
    assert!(write_workflow(&inside).unwrap_err().to_string().contains("cannot be the output folder"));
}
