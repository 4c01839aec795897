//! The commands `calibrate` and `plan` as a shell sees them.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn target_field() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/surveys/target_field")
}

fn rangecam(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rangecam")).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

const TERMS: &str = "xp,yp,c,k1,k2,p1,p2,d0,d4,d5,d6,d7,e1,e2";

#[test]
fn help_names_every_method_and_option() {
    let help = text(&rangecam(&["calibrate", "--help"]).stdout);
    for word in [
        "one-step",
        "two-step-independent",
        "two-step-dependent",
        "joint",
        "laboratory",
        "planes",
        "--terms",
        "--datum",
        "--lens-survey",
        "--joint",
        "--without-ranges",
        "--reject",
        "--calibration",
        "--out",
        "--sigma-pixel",
    ] {
        assert!(help.contains(word), "help does not name {word}:\n{help}");
    }
    let help = text(&rangecam(&["plan", "--help"]).stdout);
    assert!(help.contains("stations.csv") && help.contains("--candidate-distances"), "{help}");
}

#[test]
fn words_json_and_silence() {
    let folder = tempfile::tempdir().unwrap();
    let (survey, out) = (target_field(), folder.path().join("out"));
    let (survey, out) = (survey.to_str().unwrap(), out.to_str().unwrap());
    let words = rangecam(&["calibrate", survey, "--terms", TERMS, "--out", out]);
    assert!(words.status.success(), "{}", text(&words.stderr));
    let words = text(&words.stdout);
    for word in ["redundancy", "sigma0", "d0", "estimated", "held", "rejected", "written to"] {
        assert!(words.contains(word), "{words}");
    }
    let json = rangecam(&["calibrate", survey, "--terms", TERMS, "--out", out, "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
    assert_eq!(json["converged"], true);
    let quiet = rangecam(&["plan", survey, "--out", out, "--quiet"]);
    assert!(quiet.status.success() && quiet.stdout.is_empty() && quiet.stderr.is_empty());
}

#[test]
fn exit_codes_tell_wrong_arguments_from_failed_work() {
    let wrong = rangecam(&["calibrate", "x", "--method", "guess"]);
    assert_eq!(wrong.status.code(), Some(2));
    assert!(text(&wrong.stderr).contains("one-step"), "the possible values are named");
    assert_eq!(rangecam(&["calibrate", "x", "--reject", "2"]).status.code(), Some(2));
    let failed = rangecam(&["calibrate", "no/such/survey"]);
    assert_eq!(failed.status.code(), Some(2));
    assert!(text(&failed.stderr).contains("no/such/survey"));
}

/// All terms of a network that has no scale but its ranges can't be told apart: refused, and said so in JSON as well.
#[test]
fn a_refusal_is_a_failure_with_a_summary() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let survey = target_field();
    let refused = rangecam(&[
        "calibrate",
        survey.to_str().unwrap(),
        "--terms",
        "xp,yp,c,k1,k2,k3,p1,p2,d0,d2,d3,d4,d5,d6,d7,e1,e2",
        "--largest-inflation",
        "20",
        "--json",
        "--out",
        out.to_str().unwrap(),
    ]);
    assert_eq!(refused.status.code(), Some(3));
    assert!(text(&refused.stderr).contains("refused"), "{}", text(&refused.stderr));
    let printed: serde_json::Value = serde_json::from_slice(&refused.stdout).unwrap();
    let written = std::fs::read_to_string(out.join("summary.json")).unwrap();
    assert_eq!(printed, serde_json::from_str::<serde_json::Value>(&written).unwrap());
    assert_eq!(printed["converged"], false);
    assert!(printed["diagnosis"][0].as_str().unwrap().len() > 20);
}

/// Two stations of an SR4000, 0.3 m apart along the line of sight.
fn two_real_stations(folder: &Path) -> Option<()> {
    let captures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/real/sr4000_steps");
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/surveys/sr4000_steps/survey.ron");
    if !captures.is_dir() {
        println!("skipped: {} is not there", captures.display());
        return None;
    }
    for file in std::fs::read_dir(&captures).unwrap().map(|entry| entry.unwrap().path()) {
        if file.extension().is_some_and(|ending| ending == "npz") {
            std::fs::copy(&file, folder.join(file.file_name().unwrap())).unwrap();
        }
    }
    let survey = std::fs::read_to_string(fixture).unwrap().replace("../../../../shared/real/sr4000_steps/", "");
    std::fs::write(folder.join("survey.ron"), survey).unwrap();
    let stations = "station,x,y,z,omega,phi,kappa\nY1,0,0,0,0,0,0\nY2,0,0,-0.3,0,0,0\n";
    std::fs::write(folder.join("stations.csv"), stations).unwrap();
    Some(())
}

#[test]
fn what_two_real_stations_leave_open_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let (survey, out) = (folder.path().join("survey"), folder.path().join("out"));
    std::fs::create_dir(&survey).unwrap();
    let Some(()) = two_real_stations(&survey) else { return };
    let calibrate = |terms: &str| {
        let (survey, out) = (survey.to_str().unwrap(), out.to_str().unwrap());
        rangecam(&["calibrate", survey, "--method", "surfaces", "--terms", terms, "--out", out, "--quiet"])
    };
    let waves = calibrate("d2,d3,d4,d5,d6,d7");
    assert!(waves.status.success(), "{}", text(&waves.stderr));
    let summary = std::fs::read_to_string(out.join("summary.json")).unwrap();
    assert!(summary.contains("d2 is held: these surfaces leave") && summary.contains("d6 is held"), "{summary}");
    assert!(!summary.contains("d7 is held"), "{summary}");
    let offset = calibrate("d0");
    assert_eq!(offset.status.code(), Some(3));
    assert!(text(&offset.stderr).contains("do not determine `d0`"), "{}", text(&offset.stderr));
    assert_eq!(calibrate("auto").status.code(), Some(3));
}
