//! The command `register` as a shell sees it.

#![allow(clippy::unwrap_used)]

use std::fmt::Write;
use std::path::Path;
use std::process::{Command, Output};

fn rangecam(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rangecam")).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// A bumpy surface, seen with its origin moved by `x`; `shift` makes other points of the same surface.
fn write_bumps(path: &Path, x: f64, shift: f64) {
    let mut lines = String::new();
    for k in 0..6400 {
        let (u, v) = (0.02 * (f64::from(k % 80) + shift), 0.02 * (f64::from(k / 80) + shift));
        let z = 0.12 * (2.1 * u).sin() * (5.3 * v).cos() + 0.07 * (7.0 * u + 1.0).cos() + 0.3 * (u - 0.7) * v;
        writeln!(lines, "{} {} {}", u - x, v, z).unwrap();
    }
    std::fs::write(path, lines).unwrap();
}

#[test]
fn help_names_every_option() {
    let help = text(&rangecam(&["register", "--help"]).stdout);
    for word in ["--guess", "--multi", "--calibration", "--out", "--json", "--quiet", "survey folder"] {
        assert!(help.contains(word), "{word} in {help}");
    }
}

#[test]
fn two_clouds_with_a_guess() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    write_bumps(Path::new(&path("one.xyz")), 0.0, 0.0);
    write_bumps(Path::new(&path("two.xyz")), 0.05, 0.4);
    std::fs::write(path("guess.txt"), "1 0 0 0.03\n0 1 0 0\n0 0 1 0\n0 0 0 1\n").unwrap();
    let arguments = [
        "register",
        &path("one.xyz"),
        &path("two.xyz"),
        "--guess",
        &path("guess.txt"),
        "--out",
        &path("out"),
        "--json",
    ];
    let output = rangecam(&arguments);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let json: serde_json::Value = serde_json::from_str(&text(&output.stdout)).unwrap();
    let x = json["stations"][1]["position_m"][0].as_f64().unwrap();
    // Points 2 cm apart on a curved surface: their planes are right to a tenth of a millimetre.
    assert!((x - 0.05).abs() < 1e-3, "{x}");
    for file in ["report.html", "summary.json", "cloud.ply", "stations.csv", "trajectory.txt"] {
        assert!(folder.path().join("out").join(file).is_file(), "{file}");
    }
}

#[test]
fn errors_say_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let cloud = folder.path().join("one.xyz").display().to_string();
    write_bumps(Path::new(&cloud), 0.0, 0.0);
    let one = rangecam(&["register", &cloud]);
    assert_eq!(one.status.code(), Some(1));
    assert!(text(&one.stderr).contains("name a second one"), "{}", text(&one.stderr));
    assert_eq!(rangecam(&["register"]).status.code(), Some(2), "an input is required");
    let absent = rangecam(&["register", "/nowhere/survey"]);
    assert!(text(&absent.stderr).contains("there is no such file or folder"), "{}", text(&absent.stderr));
}
