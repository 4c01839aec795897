//! Every command line that the documentation shows is run, or held against what the command and the repository know.

// What runs long is seen by its line.
#![allow(clippy::print_stdout)]

use std::path::{Path, PathBuf};
use std::process::Command;

/// Lines that are not run, each with the reason; their options are held against the command's help.
const NOT_RUN: [(&str, &str); 4] = [
    ("rangecam calibrate survey --terms xp,yp,c,k1,k2,p1,p2,d0,spline12", "needs distances over the whole interval"),
    (
        "rangecam calibrate survey --method two-step-independent",
        "needs targets whose coordinates were measured otherwise",
    ),
    ("rangecam register sevenscenes/seq-01 --track", "needs a recorded sequence of some hundred frames"),
    ("rangecam compare out/kitchen sevenscenes/seq-01", "compares with that sequence"),
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// All pages of the documentation with their text.
fn pages() -> Vec<(PathBuf, String)> {
    let listed = |folder: PathBuf| std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let crates = listed(root().join("crates")).map(|path| path.join("README.md"));
    let all = listed(root()).chain(listed(root().join("docs"))).chain(crates);
    let mut pages: Vec<PathBuf> = all.filter(|path| path.extension().is_some_and(|ending| ending == "md")).collect();
    pages.sort();
    pages.into_iter().map(|page| (page.clone(), std::fs::read_to_string(page).unwrap())).collect()
}

/// The words of a command line without its comment.
fn words(line: &str) -> Vec<String> {
    line.split(" #").next().unwrap().split_whitespace().map(str::to_owned).collect()
}

/// Lines of fenced blocks that begin with `program`, with their places.
fn shell_lines(program: &str) -> Vec<(String, String)> {
    let mut found = Vec::new();
    for (page, text) in pages() {
        let mut fenced = false;
        for (index, line) in text.lines().enumerate() {
            fenced ^= line.trim_start().starts_with("```");
            let line = line.trim().trim_start_matches("$ ");
            if fenced && line.split(' ').next() == Some(program) && !line.contains(" = ") {
                found.push((format!("{}:{}", page.display(), index + 1), line.to_owned()));
            }
        }
    }
    found
}

/// What stands between single backticks and begins with `program` and a space.
fn mentions(program: &str) -> Vec<(String, String)> {
    let of_page = |(page, text): (PathBuf, String)| {
        let text = text.replace('\n', " ");
        let spans: Vec<String> = text.split('`').skip(1).step_by(2).map(str::to_owned).collect();
        spans.into_iter().map(move |span| (page.display().to_string(), span))
    };
    let begins = |(_, span): &(String, String)| span.starts_with(&format!("{program} "));
    pages().into_iter().flat_map(of_page).filter(begins).collect()
}

fn rangecam(arguments: &[&str], folder: &Path) -> (Option<i32>, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_rangecam")).args(arguments).current_dir(folder).output().unwrap();
    (output.status.code(), [output.stdout, output.stderr].map(|said| String::from_utf8(said).unwrap()).concat())
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap().flatten() {
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &target);
        } else {
            std::fs::copy(entry.path(), target).unwrap();
        }
    }
}

fn simulate(scene: &str, folder: &Path) {
    let scene = root().join("fixtures/scenes").join(scene);
    let (code, said) = rangecam(&["simulate", scene.to_str().unwrap(), "--out", "survey"], folder);
    assert_eq!(code, Some(0), "{said}");
}

/// A folder with what the lines name: surveys of targets or of frames, calibrations, a pipeline. `room` holds the small room as a survey.
fn furnished(line: &str, room: &Path) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let fixtures = root().join("fixtures");
    copy(&fixtures.join("surveys/target_field"), &at("fixtures/surveys/target_field"));
    if line.contains(" calibrate ") {
        if line.contains("joint") {
            let network = fixtures.join("networks/joint.ron");
            let (code, said) =
                rangecam(&["simulate-network", network.to_str().unwrap(), "--out", "survey"], folder.path());
            assert_eq!(code, Some(0), "{said}");
        } else {
            copy(&fixtures.join("surveys/target_field"), &at("survey"));
            copy(&fixtures.join("surveys/target_field"), &at("lens-survey"));
        }
        return folder;
    }
    if line.contains(" images ") {
        std::fs::create_dir(at("images")).unwrap();
        let draw = if line.contains(" rings ") { crate::pictures::write_rings } else { crate::pictures::write_board };
        draw(&at("images/1.png"));
        return folder;
    }
    if line.contains(" spheres ") {
        simulate("spheres.ron", folder.path());
        let places =
            "A,-0.5,0.35,0.5,,,\nB,0.45,0.3,0.3,,,\nC,0.35,-0.4,0.6,,,\nD,-0.4,-0.35,0.2,,,\nE,0.0,0.05,0.4,,,\n";
        std::fs::write(at("survey/targets.csv"), format!("target,x,y,z,sigma_x,sigma_y,sigma_z\n{places}")).unwrap();
        return folder;
    }
    copy(&room.join("survey"), &at("survey"));
    if line.contains(" archive ") {
        std::fs::create_dir_all(at("archive/north/2026-05-04/hall")).unwrap();
    }
    for place in ["spring", "autumn", "out/calibration"] {
        std::fs::create_dir_all(at(place)).unwrap();
        std::fs::copy(at("survey/calibration.ron"), at(place).join("calibration.ron")).unwrap();
    }
    let pipeline = std::fs::read_to_string(fixtures.join("pipelines/room_small.ron")).unwrap();
    std::fs::write(at("room.ron"), pipeline).unwrap();
    // One that takes a part of the stations.
    std::fs::write(at("part.ron"), "(name: \"part\", stages: [Demodulate(), Average(), Unwrap(), PointCloud()])")
        .unwrap();
    folder
}

#[test]
fn every_line_of_the_command_runs() {
    let lines = shell_lines("rangecam");
    assert!(lines.len() > 5, "{lines:?}");
    for (listed, reason) in NOT_RUN {
        assert!(lines.iter().any(|(_, line)| line.starts_with(listed)), "{listed} ({reason}) is not shown any more");
    }
    let room = tempfile::tempdir().unwrap();
    simulate("room_small.ron", room.path());
    for (place, line) in lines.iter().filter(|(_, line)| !NOT_RUN.iter().any(|(listed, _)| line.starts_with(listed))) {
        println!("{place}: {line}");
        let folder = furnished(line, room.path());
        let words = words(line);
        let arguments: Vec<&str> = words[1..].iter().map(String::as_str).collect();
        let (code, said) = rangecam(&arguments, folder.path());
        // Done, or done with a doubt: what is shown is neither wrong usage nor refused.
        assert!(matches!(code, Some(0 | 1)), "{place}: {line}: {code:?}: {said}");
    }
}

#[test]
fn every_mention_of_the_command_names_what_it_has() {
    let folder = tempfile::tempdir().unwrap();
    let mut shown = shell_lines("rangecam");
    shown.extend(mentions("rangecam"));
    assert!(shown.len() > 20);
    for (place, line) in shown {
        let words = words(&line);
        let (code, help) = rangecam(&[&words[1], "--help"], folder.path());
        assert_eq!(code, Some(0), "{place}: {line}: {help}");
        for option in words.iter().filter_map(|word| word.trim_start_matches('[').strip_prefix("--")) {
            let option = option.trim_end_matches(']');
            assert!(help.contains(&format!("--{option}")), "{place}: {line}: there is no --{option}");
        }
    }
}

#[test]
fn every_mention_of_cargo_names_what_is_there() {
    let mut shown = shell_lines("cargo");
    shown.extend(mentions("cargo"));
    assert!(shown.len() > 20);
    for (place, line) in shown {
        let words = words(&line);
        let after = |option: &str| words.iter().position(|word| word == option).and_then(|at| words.get(at + 1));
        // A crate's own README may leave the package out.
        let own =
            Path::new(&place.split(".md:").next().unwrap().replace("/README.md", "").replace("/README", "")).to_owned();
        let package = after("-p").or(after("--package")).map_or(own, |name| root().join("crates").join(name));
        if !["run", "test", "bench", "xtask"].contains(&words[1].as_str()) {
            continue;
        }
        if words[1] == "xtask" {
            require_task(&place, &line, &words);
            continue;
        }
        assert!(package.is_dir(), "{place}: {line}: there is no {}", package.display());
        if let Some(example) = after("--example") {
            let file = package.join("examples").join(example);
            assert!(file.is_dir() || file.with_extension("rs").is_file(), "{place}: {line}: no example {example}");
        }
        if let Some(filter) = after("suite").filter(|filter| *filter != "--") {
            let files = std::fs::read_dir(package.join("tests")).unwrap().map(|entry| entry.unwrap().path());
            // A filter is a part of the name of a test or of its module.
            let named = files.filter(|file| file.is_file()).any(|file| {
                std::fs::read_to_string(file).unwrap().lines().any(|line| {
                    let name = line.trim().strip_prefix("fn ").or(line.strip_prefix("mod "));
                    name.is_some_and(|name| name.contains(filter.as_str()))
                })
            });
            assert!(named, "{place}: {line}: no test {filter}");
        }
    }
}

/// `cargo xtask TASK [NAME]`: the task, and the pipeline or peer that it names.
fn require_task(place: &str, line: &str, words: &[String]) {
    let Some(task) = words.get(2) else { return };
    if task.chars().all(char::is_uppercase) {
        return;
    }
    let program = std::fs::read_to_string(root().join("xtask/src/main.rs")).unwrap();
    let variant = task[..1].to_uppercase() + &task[1..];
    assert!(program.contains(&format!("Task::{variant}")), "{place}: {line}: no task {task}");
    let Some(name) = words.get(3).filter(|name| name.chars().all(|c| c.is_lowercase() || c == '_')) else { return };
    let there = match task.as_str() {
        "pipeline" => root().join("fixtures/pipelines").join(name).with_extension("ron").is_file(),
        "peers" | "verify" => {
            let sources = ["peers", "verify/mod.rs"].map(|part| root().join("xtask/src").join(part));
            let files = std::fs::read_dir(&sources[0]).unwrap().map(|entry| entry.unwrap().path());
            let mut texts = files.chain([sources[1].clone()]).filter_map(|file| std::fs::read_to_string(file).ok());
            texts.any(|text| text.contains(&format!("\"{name}\"")))
        }
        "bench" => root().join("crates").join(name).is_dir(),
        _ => true,
    };
    assert!(there, "{place}: {line}: {task} knows no {name}");
}
