//! The commands `noise` and `fpn` as a shell sees them.

use std::path::Path;
use std::process::{Command, Output, Stdio};

fn rangecam(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rangecam")).args(arguments).output().unwrap()
}

fn json(output: &Output) -> serde_json::Value {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn noise_and_fixed_pattern_of_a_simulated_wall() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/scenes/repeats.ron");
    let (survey, noise, pattern) = (path("survey"), path("noise"), path("fpn"));
    assert!(rangecam(&["simulate", scene.to_str().unwrap(), "--out", &survey, "--quiet"]).status.success());
    let found = json(&rangecam(&["noise", &survey, "--out", &noise, "--json"]));
    assert_eq!(found["noise_of"], "samples");
    assert_eq!(found["parameters"][0]["name"], "shot_variance_per_unit");
    // A reader that closes the pipe before anything is said has read enough.
    let again = path("again");
    let mut unheard = Command::new(env!("CARGO_BIN_EXE_rangecam"));
    let unheard = unheard.args(["noise", &survey, "--out", &again, "--json"]);
    let mut unheard = unheard.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(unheard.stdout.take());
    let unheard = unheard.wait_with_output().unwrap();
    assert!(unheard.status.success(), "{}", String::from_utf8_lossy(&unheard.stderr));
    // One command's calibration is the next one's start.
    let calibration = format!("{noise}/calibration.ron");
    let found = json(&rangecam(&["fpn", &survey, "--calibration", &calibration, "--out", &pattern, "--json"]));
    assert_eq!(found["applied"], true);
    let text = std::fs::read_to_string(format!("{pattern}/calibration.ron")).unwrap();
    assert!(text.contains("noise from") && text.contains("fixed pattern from"), "both are in the provenance");
    // A window that is no window of the image.
    let refused = rangecam(&["fpn", &survey, "--window", "200,210,0,5", "--out", &path("none")]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("are not within 0 to"));
}
