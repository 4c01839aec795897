//! The command `compare` as a shell sees it.

use std::process::{Command, Output};

fn rangecam(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rangecam")).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

#[test]
fn two_lists_of_points_in_words_as_json_and_as_a_page() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let grid = |z: f64| -> String {
        let lines: Vec<String> = (0..400).map(|i| format!("{} {} {z}", i % 20, i / 20)).collect();
        lines.join("\n")
    };
    std::fs::write(path("a.xyz"), grid(-5.0)).unwrap();
    std::fs::write(path("b.xyz"), grid(-5.25)).unwrap();
    let words = rangecam(&["compare", &path("a.xyz"), &path("b.xyz")]);
    let said = text(&words.stdout);
    assert!(words.status.success() && said.contains("distance to"), "{said}");
    // Median, 95 %, rms, largest and, where distances have signs, their mean.
    let line =
        |what: &str| said.lines().find(|line| line.starts_with(what)).map(|line| line.matches(" 250 mm").count());
    assert_eq!(line("nearest point"), Some(4), "{said}");
    assert_eq!(line("local plane"), Some(5), "nearer to the origin is positive: {said}");
    let out = path("out");
    let json = rangecam(&["--json", "compare", &path("a.xyz"), &path("b.xyz"), "--out", &out]);
    let value: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
    assert_eq!(value["clouds"]["distance_max_m"], 0.25);
    assert!(folder.path().join("out/report.html").is_file());
}

#[test]
fn wrong_input_ends_with_a_message_and_code_2() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.txt").to_str().unwrap().to_owned();
    std::fs::write(&path, "nothing\n").unwrap();
    let output = rangecam(&["compare", &path, &path]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("a.txt is nothing that can be compared"), "{}", text(&output.stderr));
    let help = text(&rangecam(&["compare", "--help"]).stdout);
    for word in ["--align", "--scale", "--max-distance", "--time-tolerance", "--out", "E57", "EuRoC"] {
        assert!(help.contains(word), "{word} in {help}");
    }
}
