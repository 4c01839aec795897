//! Threads, parts, what is done already, workflows: what one machine cannot do, and what it need not do twice.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use tempfile::TempDir;

pub fn rangecam(folder: &Path, line: &str) -> (Option<i32>, String) {
    let words: Vec<&str> = line.split_whitespace().collect();
    let output = Command::new(env!("CARGO_BIN_EXE_rangecam")).args(words).current_dir(folder).output().unwrap();
    (output.status.code(), [output.stdout, output.stderr].map(|said| String::from_utf8(said).unwrap()).concat())
}

pub fn done(folder: &Path, line: &str) -> String {
    let (code, said) = rangecam(folder, line);
    assert!(matches!(code, Some(0 | 1)), "{line}: {code:?}: {said}");
    said
}

/// Every file by its name.
pub fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut pending = vec![folder.to_owned()];
    while let Some(path) = pending.pop() {
        for path in fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path()) {
            if path.is_dir() {
                pending.push(path);
            } else {
                found.insert(path.strip_prefix(folder).unwrap().to_owned(), fs::read(&path).unwrap());
            }
        }
    }
    found
}

/// A folder with a survey of four stations and a pipeline.
pub fn world() -> TempDir {
    let root = tempfile::tempdir().unwrap();
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures");
    let text = fs::read_to_string(fixtures.join("scenes/room_small.ron")).unwrap();
    let text = text
        .replace("width: 132, height: 108", "width: 66, height: 54")
        .replace("0.05333333333333334", "0.10666666666666667")
        .replace("frames_per_station: 4", "frames_per_station: 2");
    fs::write(root.path().join("room.ron"), text).unwrap();
    let stages = "Demodulate(low_amplitude: 20), Average(), Unwrap(), CorrectRange(), PointCloud(), Flag()";
    fs::write(root.path().join("p.ron"), format!("(name: \"p\", stages: [{stages}])")).unwrap();
    fs::write(root.path().join("joins.ron"), format!("(name: \"j\", stages: [{stages}, Register()])")).unwrap();
    done(root.path(), "simulate room.ron --out archive/north/monday/hall");
    root
}

pub const RUN: &str = "run archive/north/monday/hall --pipeline p.ron --no-times";

#[test]
fn results_depend_neither_on_threads_nor_on_parts() {
    let root = world();
    let at = |name: &str| root.path().join(name);
    done(root.path(), &format!("{RUN} --out whole --threads 1"));
    let whole = files(&at("whole"));
    done(root.path(), &format!("{RUN} --threads 3 --out whole"));
    assert!(whole == files(&at("whole")), "three threads give other bytes");
    for part in 1..=3 {
        done(root.path(), &format!("--threads 2 {RUN} --shard {part}/3 --out parts/{part}"));
    }
    done(root.path(), "merge parts/3 parts/1 parts/2 --out whole --no-times");
    let merged = files(&at("whole"));
    for (name, bytes) in &whole {
        assert!(*bytes == merged[name], "{} of the parts made whole differs", name.display());
    }
    assert_eq!(whole.len(), merged.len());
    let summary: serde_json::Value = serde_json::from_slice(&whole[Path::new("summary.json")]).unwrap();
    assert_eq!(summary["made"]["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(summary["made"]["inputs"].as_array().unwrap().len(), 5, "{}", summary["made"]["inputs"]);
    let (code, said) = rangecam(root.path(), "run archive/north/monday/hall --pipeline joins.ron --shard 1/2 --out x");
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("Register"), "{said}");
    for wrong in ["run x --pipeline p.ron --shard 0/2", "run x --pipeline p.ron --threads 0"] {
        assert_eq!(rangecam(root.path(), wrong).0, Some(2), "{wrong}");
    }
}

/// Only what was made from the same inputs, with the same options and by the same program is left alone.
#[test]
fn what_is_done_is_not_done_again() {
    let root = world();
    let line = format!("{RUN} --skip-done --out out");
    let again = |line: &str| {
        let (code, said) = rangecam(root.path(), line);
        if said.contains("left as it is") {
            assert_eq!(code, Some(0), "{said}");
        }
        said.contains("left as it is")
    };
    assert!(!again(&line));
    assert!(again(&line) && again(&format!("{line} --threads 1")));
    // Without being asked, it is made anew; then it is the same record.
    assert!(!again(&line.replace("--skip-done ", "")) && again(&line));
    // Other options, other inputs, a file that is gone, a refusal beside it.
    let other = format!("{line} --calibration archive/north/monday/hall/truth/calibration.ron");
    assert!(!again(&other) && again(&other) && !again(&line) && again(&line));
    let plan = fs::read_to_string(root.path().join("p.ron")).unwrap();
    fs::write(root.path().join("p.ron"), plan.replace("low_amplitude: 20", "low_amplitude: 21")).unwrap();
    assert!(!again(&line) && again(&line));
    let frame = root.path().join("archive/north/monday/hall/frames/000_0.npz");
    fs::copy(root.path().join("archive/north/monday/hall/frames/000_1.npz"), &frame).unwrap();
    assert!(!again(&line) && again(&line));
    fs::remove_file(root.path().join("out/trajectory.txt")).unwrap();
    assert!(!again(&line) && again(&line));
    // Of a part the frames of other parts are no input.
    let part = format!("{RUN} --skip-done --shard 1/2 --out part");
    assert!(!again(&part) && again(&part));
    let last = root.path().join("archive/north/monday/hall/frames/007_0.npz");
    fs::copy(root.path().join("archive/north/monday/hall/frames/007_1.npz"), last).unwrap();
    assert!(again(&part) && !again(&line));
}

/// Every call of the workflow's rules, in the order in which the engine makes them.
#[test]
fn the_steps_of_a_workflow_run() {
    let root = world();
    let said = done(root.path(), "workflow archive --pipeline p.ron --shards 2 --out flow");
    assert!(said.contains("recordings: 1; cameras: 1; days: 1; parts of each: 2; jobs: 4"), "{said}");
    let snakefile = fs::read_to_string(root.path().join("flow/Snakefile")).unwrap();
    for command in ["calibrate", "check", "warmup", "run", "merge", "fleet"] {
        assert!(snakefile.contains(&format!(" {command} ")), "{command}");
        assert_eq!(rangecam(root.path(), &format!("{command} --help")).0, Some(0));
    }
    let work = root.path().join("work");
    let recording = "north/monday/recordings/hall";
    for part in 1..=2 {
        let line = "--skip-done --threads 1 --no-times --quiet run ../archive/north/monday/hall --pipeline ../flow/pipeline.ron";
        fs::create_dir_all(&work).unwrap();
        done(&work, &format!("{line} --shard {part}/2 --out parts/north/monday/hall/{part}"));
    }
    let parts = "parts/north/monday/hall/1 parts/north/monday/hall/2";
    let (code, said) =
        rangecam(&work, &format!("--skip-done --no-times --quiet merge {parts} --out results/{recording}"));
    assert!(matches!(code, Some(0 | 1)), "{said}");
    fs::create_dir_all(work.join("codes/north/monday/recordings")).unwrap();
    fs::write(work.join(format!("codes/{recording}.code")), code.unwrap().to_string()).unwrap();
    let said = done(&work, "fleet . --out fleet");
    assert!(said.contains("Recordings: 1; cameras: 1; with a result: 1"), "{said}");
    let table = fs::read_to_string(work.join("fleet/fleet.csv")).unwrap();
    assert!(table.lines().nth(1).unwrap().starts_with("north,monday,hall,"), "{table}");
    // The report is done, too, until a step is.
    assert!(done(&work, "fleet . --out fleet --skip-done").contains("left as it is"));
}
