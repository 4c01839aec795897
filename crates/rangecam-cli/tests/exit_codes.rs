//! What the shell sees, for each kind of ending.

use std::fs::File;
use std::path::Path;
use std::process::{Command, Output, Stdio};

fn fixture(path: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures").join(path).display().to_string()
}

fn rangecam(line: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rangecam")).args(line).output().unwrap()
}

fn code(line: &[&str]) -> i32 {
    let output = rangecam(line);
    // -1: ended by a signal.
    output.status.code().unwrap_or(-1)
}

#[test]
fn help_tells_the_codes() {
    let help = String::from_utf8(rangecam(&["--help"]).stdout).unwrap();
    for line in ["0  done", "1  done but doubtful", "2  wrong input", "3  refused", "4  failure", "5  done in part"] {
        assert!(help.contains(line), "{help}");
    }
}

#[test]
fn wrong_input_is_2() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    std::fs::write(path("bad.ron"), "(").unwrap();
    std::fs::write(path("name.ron"), "(name: \"../x\", stages: [Average()])").unwrap();
    std::fs::write(path("file"), "").unwrap();
    std::fs::write(path("empty.xyz"), "").unwrap();
    let field = fixture("surveys/target_field");
    let out = path("out");
    for line in [
        &["calibrate", "no/such/survey", "--out", &out] as &[&str],
        &["calibrate", &field, "--out", &path("file")],
        &["calibrate", &field, "--out", "/"],
        &["calibrate", &field, "--terms", "c,zz", "--out", &out],
        &["calibrate", &field, "--method", "laboratory", "--datum", "nothing", "--out", &out],
        &["run", &field, "--pipeline", &path("bad.ron"), "--out", &out],
        &["run", &field, "--pipeline", &path("name.ron"), "--out", &out],
        &["simulate", &path("bad.ron"), "--out", &out],
        &["noise", &path("none"), "--out", &out],
        &["register", &path("empty.xyz"), &path("file"), "--out", &out],
        &["compare", &path("file"), &field],
        &["inspect", &path("none")],
        &["diff", &path("none"), &path("none")],
        &["explain", &field, "--frame", "0", "--pixel", "0,0"],
        &["nothing"],
    ] {
        assert_eq!(code(line), 2, "{line:?}: {}", String::from_utf8_lossy(&rangecam(line).stderr));
        assert!(!Path::new(&out).exists(), "{line:?}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn what_can_not_be_printed_is_4_and_a_closed_pipe_0() {
    let field = fixture("surveys/target_field");
    let full = || Stdio::from(File::options().write(true).open("/dev/full").unwrap());
    let mut command = Command::new(env!("CARGO_BIN_EXE_rangecam"));
    let output = command.args(["inspect", &field]).stdout(full()).output().unwrap();
    assert_eq!(output.status.code(), Some(4), "{}", String::from_utf8_lossy(&output.stderr));
    let shell = format!("set -o pipefail; {} inspect {field} | true", env!("CARGO_BIN_EXE_rangecam"));
    for _ in 0..20 {
        let piped = Command::new("bash").args(["-c", &shell]).status().unwrap();
        assert_eq!(piped.code(), Some(0));
    }
}

/// A place for results that may not be written to is a wrong name; one that is full is the machine's.
#[cfg(target_os = "linux")]
#[test]
fn a_place_that_takes_nothing_is_2() {
    let field = fixture("surveys/target_field");
    assert_eq!(code(&["calibrate", &field, "--terms", "d0", "--out", "/proc/rangecam/out"]), 2);
}
