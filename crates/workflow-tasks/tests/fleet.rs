//! Reports of what workflows did.

use std::fs;
use std::path::Path;

use workflow_tasks::commands::{Error, Judged, Verdict};
use workflow_tasks::{FleetRequest, fleet};

fn put(root: &Path, file: &str, text: &str) {
    let file = root.join(file);
    fs::create_dir_all(file.parent().unwrap()).unwrap();
    fs::write(file, text).unwrap();
}

/// Two cameras, one of which moved; three recordings, one of which is refused.
fn ran(root: &Path) -> FleetRequest {
    put(root, "codes/a/calibration.code", "0\n");
    put(root, "results/a/calibration/summary.json", r#"{"sigma0": 1.02, "doubts": []}"#);
    for (day, code, found) in [
        ("d1", "0", r#"{"moved": false, "matters": false, "change_rms_m": 0.0002}"#),
        ("d2", "1", r#"{"moved": true, "matters": true, "change_rms_m": 0.0125}"#),
    ] {
        put(root, &format!("codes/a/{day}/check.code"), code);
        put(root, &format!("checks/a/{day}.json"), found);
        put(root, &format!("codes/a/{day}/recordings/hall.code"), "1");
        let doubts = r#"[{"kind": "wraps", "words": "x"}, {"kind": "wraps", "subject": "S1", "words": "y"}]"#;
        let summary = format!(
            r#"{{"frames": 4, "stations": 2, "points": 10, "sigma_range_median_m": 0.004, "flags_fraction": {{"any": 0.5, "motion": 0.25}}, "doubts": {doubts}, "made": {{"version": "0.1.0", "digest": "ab"}}}}"#
        );
        put(root, &format!("results/a/{day}/recordings/hall/summary.json"), &summary);
    }
    put(root, "codes/b/d1/check.code", "3");
    put(root, "logs/b/d1/check.log", "error: no surface in common\n");
    put(root, "codes/b/d1/recordings/yard.code", "2");
    put(root, "logs/b/d1/recordings/yard.log", "something\nerror: frames/0.npz: cut off, \"here\"\n");
    // What an older, successful run left is not that of the one that failed.
    put(root, "results/b/d1/recordings/yard/summary.json", r#"{"points": 5}"#);
    FleetRequest { folder: root.to_owned(), out: root.join("fleet") }
}

#[test]
fn a_fleet_is_one_table_and_one_report() {
    let root = tempfile::tempdir().unwrap();
    let request = ran(root.path());
    let found = fleet(&request).unwrap();
    assert_eq!((found.recordings, found.with_result, found.cameras.len()), (3, 2, 2));
    assert_eq!(found.flags_fraction["any"], 0.5);
    assert_eq!(found.flags_fraction["motion"], 0.25);
    assert_eq!(found.verdict(), Verdict::Doubtful);
    let words: Vec<String> = found.doubts.iter().map(ToString::to_string).collect();
    assert!(
        words[0].contains("a: its calibration is no longer right on 1 of 2 days checked")
            && words[0].contains("12.5 mm")
    );
    let codes: Vec<(u8, usize)> = found.failures.iter().map(|failure| (failure.code, failure.steps.len())).collect();
    assert_eq!(codes, [(2, 1), (3, 1)]);
    assert_eq!(found.failures[0].steps[0], "b/d1/recordings/yard: frames/0.npz: cut off, \"here\"");
    assert_eq!((found.doubt_kinds[0].kind.as_str(), found.doubt_kinds[0].recordings), ("wraps", 2));
    let table = fs::read_to_string(request.out.join("fleet.csv")).unwrap();
    let lines: Vec<&str> = table.lines().collect();
    assert!(
        lines[0]
            .starts_with("camera,day,recording,code,frames,stations,points,sigma_range_median_m,flagged,saturated,")
    );
    assert_eq!(lines[1], "a,d1,hall,1,4,2,10,0.004,0.5,0,0,0,0.25,0,0,0,0,0,false,0.0002,wraps wraps,0.1.0,ab,");
    assert_eq!(lines[2], "a,d2,hall,1,4,2,10,0.004,0.5,0,0,0,0.25,0,0,0,0,0,true,0.0125,wraps wraps,0.1.0,ab,");
    assert_eq!(lines[3], "b,d1,yard,2,,,,,,,,,,,,,,,,,,,,\"frames/0.npz: cut off, \"\"here\"\"\"");
    let summary: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(request.out.join("summary.json")).unwrap()).unwrap();
    assert_eq!(summary["cameras"][0]["checks"][1]["matters"], true);
    assert_eq!(summary["cameras"][0]["calibration"]["sigma0"], 1.02);
    let page = fs::read_to_string(request.out.join("report.html")).unwrap();
    assert!(page.contains("no longer right") && page.contains("cannot tell"));
    // The same again is the same.
    let before = fs::read(request.out.join("report.html")).unwrap();
    fleet(&request).unwrap();
    assert_eq!(fs::read(request.out.join("report.html")).unwrap(), before);
}

#[test]
fn what_is_no_fleet_is_refused() {
    let root = tempfile::tempdir().unwrap();
    let request = FleetRequest { folder: root.path().to_owned(), out: root.path().join("fleet") };
    assert!(matches!(fleet(&request), Err(Error::Request { command: "fleet", .. })));
    put(root.path(), "codes/a/d/recordings/r.code", "many");
    assert!(fleet(&request).unwrap_err().to_string().contains("holds no exit code"));
    put(root.path(), "codes/a/d/recordings/r.code", "0");
    put(root.path(), "results/a/d/recordings/r/summary.json", "{");
    assert!(fleet(&request).unwrap_err().to_string().contains("summary.json"));
    let inside = FleetRequest { out: root.path().join("results/x"), ..request };
    assert!(fleet(&inside).unwrap_err().to_string().contains("cannot be the output folder"));
}
