//! Options that mean nothing and names that a terminal would obey, as the command sees them.

use std::path::Path;
use std::process::{Command, Output};

fn rangecam(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rangecam")).current_dir(folder).args(arguments).output().unwrap()
}

fn fixtures() -> String {
    format!("{}/../../fixtures", env!("CARGO_MANIFEST_DIR"))
}

/// The command ends with the code of a wrong input, says the words, and writes nothing.
fn refused(arguments: &[&str], words: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    refused_in(folder.path(), arguments, words);
}

fn refused_in(folder: &Path, arguments: &[&str], words: &[&str]) {
    let output = rangecam(folder, arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
    for word in words {
        assert!(said.contains(word), "{arguments:?} does not say {word:?}: {said}");
    }
    assert!(!said.contains(|c: char| c.is_control() && c != '\n' && c != '\t'), "{said:?}");
    assert!(!folder.join("out").exists(), "{arguments:?}");
}

#[test]
fn numbers_that_mean_nothing_are_refused_with_their_option() {
    let room = format!("{}/scenes/room_small.ron", fixtures());
    for value in ["nan", "inf", "-1", "x", ""] {
        let [position, attitude, share] =
            ["position-sigma", "attitude-sigma", "gross-errors"].map(|name| format!("--{name}={value}"));
        refused(&["simulate", &room, &position], &["--position-sigma", "expected a number that is not negative"]);
        refused(&["simulate", &room, &attitude], &["--attitude-sigma"]);
        refused(&["simulate", &room, &share], &["--gross-errors", "expected a part from 0 to 1"]);
        refused(&["compare", "a", "b", &format!("--max-distance={value}")], &["--max-distance"]);
        refused(&["compare", "a", "b", &format!("--time-tolerance={value}")], &["--time-tolerance"]);
        refused(&["warmup", "a", &format!("--tolerance-mm={value}")], &["--tolerance-mm"]);
        refused(&["calibrate", "a", &format!("--largest-inflation={value}")], &["--largest-inflation"]);
        refused(&["calibrate", "a", &format!("--sigma-pixel={value}")], &["--sigma-pixel"]);
        refused(&["plan", "a", &format!("--candidate-distances=1,{value}")], &["--candidate-distances"]);
    }
    refused(&["warmup", "a", "--power-on=nan"], &["--power-on", "expected a finite number"]);
    refused(&["simulate", &room, "--gross-errors", "1.5"], &["--gross-errors"]);
}

#[test]
fn empty_and_doubled_names_are_refused() {
    for command in ["calibrate", "plan"] {
        refused(&[command, "a", "--terms", ""], &["--terms", "expected names of terms"]);
        refused(&[command, "a", "--terms", " , "], &["--terms"]);
        refused(&[command, "a", "--terms", "c,d0,c"], &["--terms", "`c` is given twice"]);
        refused(&[command, "a", "--without-ranges", "S1,,S2"], &["--without-ranges", "expected a name"]);
    }
}

#[test]
fn a_window_beyond_the_image_is_refused() {
    let survey = format!("{}/surveys/sr4000_steps", fixtures());
    for window in ["0,99999,0,1", "0,1,0,99999", "0,176,0,1"] {
        refused(&["fpn", &survey, "--window", window], &["are not within 0 to"]);
    }
    for window in ["5,4,0,1", "0,1,1,0", "1,2,3", "", "0,1,0,x"] {
        refused(&["fpn", &survey, "--window", window], &["--window"]);
    }
}

#[test]
fn pipelines_that_mean_nothing_are_refused_with_their_field() {
    let folder = tempfile::tempdir().unwrap();
    let run = |stages: &str, words: &[&str]| {
        std::fs::write(folder.path().join("p.ron"), format!("(\n name: \"p\",\n stages: [{stages}],\n)")).unwrap();
        refused_in(folder.path(), &["run", "a", "-p", "p.ron"], words);
    };
    run("", &["p.ron:3:10: `stages`: is empty, expected at least one of Demodulate"]);
    run(
        "Unwrap(maximum_range_m: NaN)",
        &["p.ron:3:", "`stages[0].maximum_range_m`: is NaN, expected a positive number"],
    );
    run("Unwrap(maximum_range_m: -3)", &["`stages[0].maximum_range_m`: is -3"]);
    run("PointCloud(), Flag(low_amplitude: inf)", &["`stages[1].low_amplitude`: is inf"]);
    run("Flag(mixed_pixels: (sigmas: 0))", &["`stages[0].mixed_pixels.sigmas`: is 0"]);
    run("Register(normal_half_width_px: 0)", &["normal_half_width_px`: is 0, expected 1 to 100"]);
    run("Register(minimum_overlap: 1.5)", &["minimum_overlap`: is 1.5, expected a part from 0 to 1"]);
}

#[test]
fn networks_without_limit_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(format!("{}/networks/target_field.ron", fixtures())).unwrap();
    let simulate = |from: &str, to: &str, words: &[&str]| {
        assert!(text.contains(from), "{from}");
        std::fs::write(folder.path().join("n.ron"), text.replacen(from, to, 1)).unwrap();
        refused_in(folder.path(), &["simulate-network", "n.ron"], words);
    };
    simulate("columns: 9", "columns: 1000000000", &["n.ron:", "`field`: has 1000000000 x", "expected 1 to 100000"]);
    simulate("columns: 9", "columns: 4294967297", &["`field`: has 4294967297 x"]);
    simulate("columns: 9", "columns: 14286", &["`field`"]);
    simulate("spacing_m: 0.3", "spacing_m: NaN", &["`field.spacing_m`: is NaN"]);
    simulate("sigma_pixel: 0.05", "sigma_pixel: -0.05", &["`sightings.sigma_pixel`: is -0.05"]);
    simulate("sigma_range_m: 0.01", "sigma_range_m: inf", &["`sightings.sigma_range_m`: is inf"]);
}

#[cfg(unix)]
#[test]
fn pipes_are_refused_by_every_command() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("survey.ron");
    if !Command::new("mkfifo").arg(&pipe).status().is_ok_and(|status| status.success()) {
        return;
    }
    let words = ["is a pipe or device, expected a file"];
    refused_in(folder.path(), &["inspect", "."], &words);
    refused_in(folder.path(), &["run", ".", "-p", "survey.ron"], &words);
    refused_in(folder.path(), &["run", ".", "-p", "/dev/zero"], &words);
    refused_in(folder.path(), &["simulate", "survey.ron"], &words);
    refused_in(folder.path(), &["simulate-network", "survey.ron"], &words);
    refused_in(folder.path(), &["compare", "survey.ron", "survey.ron"], &words);
    refused_in(folder.path(), &["calibrate", ".", "--out", "../no-such-output"], &words);
    refused_in(folder.path(), &["diff", "survey.ron", "/dev/zero"], &words);
    let cloud = folder.path().join("a.xyz");
    std::fs::write(&cloud, "0 0 0\n1 0 0\n0 1 0\n").unwrap();
    refused_in(folder.path(), &["register", "a.xyz", "a.xyz", "--guess", "survey.ron"], &words);
}

#[test]
fn a_terminal_obeys_no_name() {
    let folder = tempfile::tempdir().unwrap();
    let name = "\u{1b}[2J\u{9b}1m\u{202e}.ply";
    // As an argument that is no command, as a file that is not there, and as one that is no cloud.
    refused_in(folder.path(), &[name], &["\\u{9b}1m"]);
    refused_in(folder.path(), &["inspect", name], &["\\u{1b}[2J\\u{9b}1m\\u{202e}.ply"]);
    let text = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float \u{1b}[31m\nend_header\n1\n";
    std::fs::write(folder.path().join("a.ply"), text).unwrap();
    refused_in(folder.path(), &["inspect", "a.ply"], &["a.ply"]);
    // Words of a result, too.
    let sound = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n";
    std::fs::write(folder.path().join(name), sound).unwrap();
    for arguments in [vec!["inspect", name], vec!["inspect", name, "--json"]] {
        let output = rangecam(folder.path(), &arguments);
        let said = String::from_utf8(output.stdout).unwrap();
        assert_eq!(output.status.code(), Some(0), "{said}");
        assert!(!said.contains(|c: char| (c.is_control() && c != '\n') || c == '\u{202e}'), "{said:?}");
    }
}

/// A file that is as long as it says, on a machine that has not the memory for it.
#[cfg(target_os = "linux")]
#[test]
fn memory_that_is_not_there_is_a_failure_of_the_machine() {
    let folder = tempfile::tempdir().unwrap();
    let head = "ply\nformat binary_little_endian 1.0\nelement vertex 100000000\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    let file = folder.path().join("a.ply");
    std::fs::write(&file, head).unwrap();
    // Holes take no room on the disk.
    std::fs::File::options().write(true).open(&file).unwrap().set_len(1_300_000_000).unwrap();
    let limited = "ulimit -v 1500000; exec \"$0\" inspect a.ply";
    let output = Command::new("sh")
        .arg("-c")
        .arg(limited)
        .arg(env!("CARGO_BIN_EXE_rangecam"))
        .current_dir(folder.path())
        .output();
    let output = output.unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(4), "{said}");
    assert!(said.contains("a.ply: cannot read: out of memory"), "{said}");
}
