//! `rangecam live` as a program among others: pipes, standard output, exit codes.

use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

use tempfile::TempDir;

const FRAMES: usize = 32;
/// Of them, those of the first station.
const RESTING: usize = 4;

fn rangecam() -> Command {
    Command::new(env!("CARGO_BIN_EXE_rangecam"))
}

/// A folder with the survey of a small room, which is simulated once for all tests.
fn room() -> TempDir {
    static FILES: OnceLock<Vec<(PathBuf, Vec<u8>)>> = OnceLock::new();
    let folder = tempfile::tempdir().unwrap();
    for (file, bytes) in FILES.get_or_init(simulated_room) {
        let file = folder.path().join(file);
        std::fs::create_dir_all(file.parent().unwrap()).unwrap();
        std::fs::write(file, bytes).unwrap();
    }
    folder
}

/// The files of the small room's survey.
fn simulated_room() -> Vec<(PathBuf, Vec<u8>)> {
    let folder = tempfile::tempdir().unwrap();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/scenes/room_small.ron");
    let made =
        rangecam().arg("simulate").arg(scene).args(["--out", "survey", "-q"]).current_dir(folder.path()).status();
    assert!(made.unwrap().success());
    let (mut folders, mut files) = (vec![folder.path().join("survey")], Vec::new());
    while let Some(next) = folders.pop() {
        for path in std::fs::read_dir(next).unwrap().map(|entry| entry.unwrap().path()) {
            if path.is_dir() {
                folders.push(path);
            } else {
                files.push((path.strip_prefix(folder.path()).unwrap().to_owned(), std::fs::read(&path).unwrap()));
            }
        }
    }
    files
}

/// The survey's frames as a camera's program would send them.
fn sent(folder: &Path) -> Vec<u8> {
    use range_io::survey::{InputFrame, Survey, read_frame};
    let root = folder.join("survey");
    let survey = Survey::read(&root).unwrap();
    let mut bytes = Vec::new();
    for (index, entry) in survey.frames.iter().enumerate() {
        let InputFrame::Samples(raw) = read_frame(&survey, &root, index).unwrap() else { unreachable!() };
        let header = live_tasks::FrameHeader {
            sample_type: live_tasks::SampleType::of(raw.samples()),
            width: raw.width(),
            height: raw.height(),
            frequencies: raw.modulations().len(),
            phase_steps: raw.phase_steps(),
            timestamp_s: entry.timestamp_s.unwrap(),
            integration_time_s: entry.integration_time_s,
            temperature_c: entry.temperature_c,
        };
        live_tasks::write_live_frame(&mut bytes, &header, raw.samples()).unwrap();
    }
    bytes
}

/// Runs the command with bytes on its standard input; exit code, standard output and standard error.
fn piped(folder: &Path, line: &[&str], input: Vec<u8>) -> (Option<i32>, Vec<u8>, String) {
    let mut child = rangecam()
        .arg("live")
        .args(line)
        .current_dir(folder)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut pipe = child.stdin.take().unwrap();
    // The command may have ended before it has read all.
    let writer = std::thread::spawn(move || drop(pipe.write_all(&input)));
    let ended = child.wait_with_output().unwrap();
    writer.join().unwrap();
    (ended.status.code(), ended.stdout, String::from_utf8(ended.stderr).unwrap())
}

#[test]
fn a_pipe_goes_in_and_clouds_come_out() {
    let folder = room();
    let bytes = sent(folder.path());
    let (code, clouds, words) = piped(folder.path(), &["-", "-s", "survey", "--fast", "--ply", "-"], bytes.clone());
    assert_eq!(code, Some(0), "{words}");
    let heads = clouds.windows(11).filter(|bytes| *bytes == b"end_header\n").count();
    assert!(clouds.starts_with(b"ply\n") && heads == FRAMES, "{heads}: {words}");
    assert!(words.contains("standard input: 32 frames, 0 dropped, 0 refused"), "{words}");

    let played = ["survey", "--fast", "--ply", "clouds.ply", "--json"];
    let (code, summary, words) = piped(folder.path(), &played, Vec::new());
    assert_eq!((code, words.as_str()), (Some(0), ""));
    assert!(std::fs::read(folder.path().join("clouds.ply")).unwrap() == clouds, "the recording gives other clouds");
    let summary: serde_json::Value = serde_json::from_slice(&summary).unwrap();
    assert_eq!((summary["frames"].as_u64(), summary["ended"].as_str()), (Some(32), Some("source")));

    // Images of the frames are a recording, which becomes a survey of ranges.
    let recorded = ["survey", "--fast", "--mcap", "out.mcap", "-q"];
    assert_eq!(piped(folder.path(), &recorded, Vec::new()).0, Some(0));
    let convert = ["convert", "out.mcap", "--calibration", "survey/calibration.ron", "--out", "again", "--quiet"];
    let converted = Command::new(env!("CARGO_BIN_EXE_rangecam")).args(convert).current_dir(folder.path()).output();
    let converted = converted.unwrap();
    let words = String::from_utf8_lossy(&converted.stderr);
    assert!(converted.status.code().is_some_and(|code| code < 2), "{words}");
    let survey = std::fs::read_to_string(folder.path().join("again/survey.ron")).unwrap();
    assert!(survey.contains("level: range") && folder.path().join("again/frames/000031.npz").is_file(), "{survey}");

    let (code, clouds, words) = piped(folder.path(), &["-", "-s", "survey", "--fast", "-q"], bytes);
    assert_eq!((code, clouds.len(), words.as_str()), (Some(0), 0, ""));
}

#[test]
fn exit_codes_tell_what_became_of_a_stream() {
    let folder = room();
    let bytes = sent(folder.path());
    let frame = bytes.len() / FRAMES;
    let mut damaged = bytes.clone();
    damaged[3 * frame] = b'X';
    let mut other = bytes.clone();
    other[8] ^= 1;
    for (input, expected, said) in [
        (bytes[..bytes.len() - 7].to_vec(), 1, "7 of its"),
        (damaged, 1, "RCLF"),
        (other, 2, "byte 48"),
        (b"<html>".repeat(90), 2, "RCLF"),
        (Vec::new(), 3, "no frame"),
        (bytes[..1000].to_vec(), 3, "no frame"),
    ] {
        let (code, out, words) = piped(folder.path(), &["-", "-s", "survey", "--fast"], input);
        let told = String::from_utf8(out).unwrap() + &words;
        assert_eq!(code, Some(expected), "{told}");
        assert!(told.contains(said), "{told}");
    }
    let (code, _, words) = piped(folder.path(), &["-"], bytes);
    assert!(code == Some(2) && words.contains("--survey"), "{words}");
}

#[test]
fn a_reader_that_has_seen_enough_is_no_failure() {
    let folder = room();
    let mut child = rangecam()
        .args(["live", "survey", "--fast", "--ply", "-"])
        .current_dir(folder.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut first = [0; 100];
    child.stdout.take().unwrap().read_exact(&mut first).unwrap();
    let ended = child.wait_with_output().unwrap();
    let words = String::from_utf8(ended.stderr).unwrap();
    assert_eq!(ended.status.code(), Some(0), "{words}");
    assert!(words.contains("nobody reads the results any more"), "{words}");
}

#[test]
fn a_page_says_where_it_is() {
    let folder = room();
    let filling: PathBuf = folder.path().join("filling");
    std::fs::create_dir(&filling).unwrap();
    let mut child = rangecam()
        .args(["live", "filling", "-s", "survey", "--view", "0"])
        .current_dir(folder.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut words = std::io::BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    std::io::BufRead::read_line(&mut words, &mut line).unwrap();
    let address = line.trim().strip_prefix("page: http://").and_then(|rest| rest.strip_suffix('/')).unwrap();
    let mut connection = std::net::TcpStream::connect(address).unwrap();
    write!(connection, "GET / HTTP/1.1\r\nHost: {address}\r\n\r\n").unwrap();
    let mut page = String::new();
    connection.read_to_string(&mut page).unwrap();
    assert!(page.starts_with("HTTP/1.1 200") && page.contains("<canvas"), "{page}");
    let bytes = sent(folder.path());
    for (number, frame) in bytes.chunks(bytes.len() / FRAMES).take(3).enumerate() {
        std::fs::write(filling.join("part"), frame).unwrap();
        std::fs::rename(filling.join("part"), filling.join(format!("{number}.frame"))).unwrap();
    }
    std::fs::write(filling.join("end"), "").unwrap();
    assert!(matches!(child.wait().unwrap().code(), Some(0 | 1)));
}

/// A stream that is going on in a folder that fills, with all results asked for, after some frames.
#[cfg(unix)]
fn going_on(folder: &Path) -> std::process::Child {
    let filling: PathBuf = folder.join("filling");
    std::fs::create_dir(&filling).unwrap();
    let bytes = sent(folder);
    // Frames of one station: the camera rests.
    for (number, frame) in bytes.chunks(bytes.len() / FRAMES).take(RESTING).enumerate() {
        std::fs::write(filling.join(format!("{number}.frame")), frame).unwrap();
    }
    let results = ["--ply", "c.ply", "--mcap", "i.mcap", "--trajectory", "t.txt", "--map", "m.ply"];
    for name in results.iter().filter(|name| !name.starts_with('-')) {
        std::fs::write(folder.join(name), "older").unwrap();
    }
    let child = rangecam()
        .args(["live", "filling", "-s", "survey", "--fast"])
        .args(results)
        .current_dir(folder)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // The trajectory is written line by line beside its name.
    let begun = || {
        let entries = std::fs::read_dir(folder).unwrap().map(Result::unwrap);
        let mut own = entries.filter(|entry| entry.file_name().to_string_lossy().starts_with(".t.txt.partial"));
        own.any(|entry| std::fs::read_to_string(entry.path()).unwrap().lines().count() == RESTING)
    };
    let since = std::time::Instant::now();
    while !begun() {
        assert!(since.elapsed().as_secs() < 60, "{RESTING} frames have no poses yet");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    child
}

#[cfg(unix)]
fn signal(child: &std::process::Child, name: &str) {
    assert!(Command::new("kill").args([name, &child.id().to_string()]).status().unwrap().success());
}

/// Ctrl-C ends a stream as its own end does.
#[cfg(unix)]
#[test]
fn an_interrupted_stream_has_all_results() {
    for name in ["-INT", "-TERM"] {
        let folder = room();
        let child = going_on(folder.path());
        signal(&child, name);
        let ended = child.wait_with_output().unwrap();
        let words = String::from_utf8(ended.stdout).unwrap();
        assert_eq!(ended.status.code(), Some(0), "{words}");
        assert!(words.contains("ended as asked") && words.contains(&format!("{RESTING} frames, 0 dropped")), "{words}");
        let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
        assert_eq!(String::from_utf8(read("t.txt")).unwrap().lines().count(), RESTING);
        assert!(read("m.ply").starts_with(b"ply\n") && read("c.ply").starts_with(b"ply\n"));
        assert!(read("i.mcap").ends_with(b"\x89MCAP0\r\n"));
    }
}

/// A program that is killed leaves older results as they were, and the next run removes what it left behind.
#[cfg(unix)]
#[test]
fn a_killed_stream_replaces_nothing() {
    let folder = room();
    let child = going_on(folder.path());
    signal(&child, "-KILL");
    child.wait_with_output().unwrap();
    let partial = || {
        let entries = std::fs::read_dir(folder.path()).unwrap().map(Result::unwrap);
        entries.filter(|entry| entry.file_name().to_string_lossy().contains(".partial")).count()
    };
    for name in ["c.ply", "i.mcap", "t.txt", "m.ply"] {
        assert_eq!(std::fs::read(folder.path().join(name)).unwrap(), b"older", "{name}");
    }
    assert_eq!(partial(), 3);
    let again =
        ["survey", "--fast", "--frames", "2", "--ply", "c.ply", "--mcap", "i.mcap", "--trajectory", "t.txt", "-q"];
    let (code, _, words) = piped(folder.path(), &again, Vec::new());
    assert_eq!(code, Some(0), "{words}");
    assert_eq!(partial(), 0);
}

#[test]
fn a_camera_that_is_lost_at_the_end_has_a_code_of_its_own() {
    let folder = room();
    // Poses to standard output, words to standard error. The room's stations stand far apart.
    let line = ["survey", "--fast", "--frames", "7", "--trajectory", "-"];
    let (code, poses, words) = piped(folder.path(), &line, Vec::new());
    let lines = String::from_utf8(poses).unwrap().lines().count();
    assert!(words.contains("path: ") && words.contains("station "), "{words}");
    let expected = if words.contains("path: lost") { 5 } else { i32::from(words.contains("have no pose")) };
    assert_eq!(code, Some(expected), "{words}");
    assert!((RESTING..=7).contains(&lines), "{lines}");
    let (code, _, words) = piped(folder.path(), &["survey", "--map-voxel", "0.1"], Vec::new());
    assert!(code == Some(2) && words.contains("--map"), "{words}");
}
