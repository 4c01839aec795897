//! The command `warmup` as a shell sees it.

use std::fmt::Write;
use std::path::Path;
use std::process::{Command, Output};

const SIZE: [usize; 2] = [16, 12];
const FRAMES: usize = 120;

fn rangecam(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rangecam")).args(arguments).output().unwrap()
}

/// Numbers from -1 to 1 without a pattern that would show.
fn noise(index: usize) -> f32 {
    let mixed = (index as u64).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (mixed >> 40) as f32 / (1_u64 << 23) as f32 - 1.0
}

/// A wall that comes nearer by 10 mm, with a time constant of ten minutes over an hour.
fn write_survey(folder: &Path) {
    let [width, height] = SIZE;
    let mut entries = String::new();
    for frame in 0..FRAMES {
        let time_s = 30.0 * frame as f32;
        let mut dictionary = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({height}, {width}), }}");
        // Magic, version and length take ten bytes; the header ends at a multiple of 64.
        dictionary.push_str(&" ".repeat(63 - (10 + dictionary.len()) % 64));
        dictionary.push('\n');
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((dictionary.len() as u16).to_le_bytes());
        bytes.extend(dictionary.as_bytes());
        for pixel in 0..width * height {
            let drift = 0.01 * (-time_s / 600.0).exp();
            let range = 2.1 + drift + 0.005 * noise(frame * width * height + pixel);
            bytes.extend(range.to_le_bytes());
        }
        std::fs::write(folder.join(format!("{frame}.npy")), bytes).unwrap();
        write!(entries, "(file: \"{frame}.npy\", station: \"A\", timestamp_s: {time_s:?}),").unwrap();
    }
    let camera = format!(
        "(width: {width}, height: {height}, pixel_pitch_mm: (0.04, 0.04), principal_distance_mm: 1.0, \
         principal_point_mm: (0.0, 0.0))"
    );
    let text = format!("(camera: {camera}, level: range, frames: [{entries}], power_on_s: 0.0)");
    std::fs::write(folder.join("survey.ron"), text).unwrap();
}

#[test]
fn warm_up_of_a_capture_and_its_exit_codes() {
    let folder = tempfile::tempdir().unwrap();
    let survey = folder.path().join("survey");
    std::fs::create_dir(&survey).unwrap();
    write_survey(&survey);
    let survey = survey.to_str().unwrap();
    let out = folder.path().join("out");
    let out = out.to_str().unwrap();
    let done = rangecam(&["warmup", survey, "--tolerance-mm", "1", "--out", out, "--json"]);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let found: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!(found["stable"], true, "{found}");
    let minutes = found["stable_after_s"].as_f64().unwrap() / 60.0;
    // ln 10 of ten minutes; the drift is known to some per cent.
    assert!((minutes - 23.0).abs() < 4.0, "{minutes}");
    let quiet = rangecam(&["warmup", survey, "--out", out, "--quiet"]);
    assert!(quiet.status.success() && quiet.stdout.is_empty());
    let words = rangecam(&["warmup", survey, "--out", out]);
    assert!(String::from_utf8_lossy(&words.stdout).contains("stable after"));
    // Work that fails, and arguments that are wrong.
    // A drift by temperature of frames without one is wrong usage.
    let refused = rangecam(&["warmup", survey, "--temperature", "--out", out]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("sample 0 has no temperature"));
    let refused = rangecam(&["warmup", survey, "--reference", "instead", "--out", out]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("no reference_path"));
    assert_eq!(rangecam(&["warmup", survey, "--tolerance-mm", "thin"]).status.code(), Some(2));
    assert_eq!(rangecam(&["warmup"]).status.code(), Some(2));
}
