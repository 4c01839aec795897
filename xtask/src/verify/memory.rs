//! `cargo xtask verify memory`: how much memory the commands that read many frames take on long surveys, and how long.
//!
//! Surveys name the frames of simulated ones again and again. Each command must stay below [`MOST_MB`]; what it says of such
//! surveys is not asked: doubts, refusals and results in part all count as done.

use std::fs::{read_to_string, write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::shell::{Outcome, cargo, root};

/// Largest resident set that is allowed, megabyte.
const MOST_MB: u64 = 2000;
/// Frames of a long survey.
const FRAMES: usize = 2000;
/// How often the memory of a command is looked at.
const LOOK_EVERY: Duration = Duration::from_millis(20);

/// Stages up to the cloud.
const STAGES: &str = "Demodulate(), Average(), Unwrap(), CorrectRange(), CorrectImagePoint(), PointCloud(), Flag()";

/// A command on a survey.
struct Case {
    survey: &'static str,
    command: &'static [&'static str],
}

const CASES: &[Case] = &[
    Case { survey: "one station of 2,000", command: &["run", "--pipeline", "cloud.ron"] },
    Case { survey: "200 stations of 10", command: &["run", "--pipeline", "cloud.ron"] },
    Case { survey: "2,000 stations of one, 176x144", command: &["run", "--pipeline", "cloud.ron"] },
    Case { survey: "40 stations of one, a room", command: &["run", "--pipeline", "joined.ron"] },
    Case { survey: "one station of 2,000", command: &["noise"] },
    Case { survey: "200 stations of 10", command: &["noise"] },
    Case { survey: "one station of 2,000", command: &["fpn"] },
    Case { survey: "200 stations of 10", command: &["fpn"] },
    Case { survey: "one station of 2,000", command: &["warmup"] },
    Case { survey: "one station of 2,000, a room", command: &["register", "--track"] },
];

pub(crate) fn run() -> Outcome {
    cargo(&["build", "--release", "--package", "rangecam-cli", "--bin", "rangecam"], &[])?;
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from);
    let program = target.join("release/rangecam");
    let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
    Surveys { folder: folder.path(), program: &program }.write()?;
    println!("{:<32} {:<20} {:>10} {:>8}  exit code", "survey of 640x480", "command", "most, MB", "s");
    let mut beyond = Vec::new();
    for case in CASES {
        let clock = Instant::now();
        let (most_mb, code) = case.run(&program, folder.path())?;
        let (command, seconds) = (case.command.join(" ").replace("--pipeline ", ""), clock.elapsed().as_secs_f64());
        println!("{:<32} {command:<20} {most_mb:>10} {seconds:>8.1}  {code}", case.survey);
        if most_mb > MOST_MB {
            beyond.push(format!("{command} on {}: {most_mb} MB", case.survey));
        }
    }
    if beyond.is_empty() { Ok(()) } else { Err(format!("above {MOST_MB} MB: {}", beyond.join("; "))) }
}

impl Case {
    /// Largest resident set, megabyte, and the exit code.
    fn run(&self, program: &Path, folder: &Path) -> Result<(u64, i32), String> {
        let mut command = Command::new(program);
        command.args(self.command).args(["--quiet", "--out", "out"]).arg(self.survey).current_dir(folder);
        let child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().map_err(|error| error.to_string())?;
        let (most_mb, output) = watched(child)?;
        // Done, doubtful, refused, in part.
        if let Some(code @ (0 | 1 | 3 | 5)) = output.status.code() {
            return Ok((most_mb, code));
        }
        let said = String::from_utf8_lossy(&output.stderr);
        Err(format!("{} on {}: {}: {said}", self.command.join(" "), self.survey, output.status))
    }
}

/// The largest resident set of a process, which the kernel keeps, megabyte.
fn watched(mut child: Child) -> Result<(u64, std::process::Output), String> {
    let status = PathBuf::from(format!("/proc/{}/status", child.id()));
    let mut most_kb = 0;
    while child.try_wait().map_err(|error| error.to_string())?.is_none() {
        let text = read_to_string(&status).unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let known = line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok());
        most_kb = known.unwrap_or(0).max(most_kb);
        std::thread::sleep(LOOK_EVERY);
    }
    if most_kb == 0 {
        return Err(format!("{} tells no VmHWM: this needs Linux", status.display()));
    }
    Ok((most_kb.div_ceil(1000), child.wait_with_output().map_err(|error| error.to_string())?))
}

/// The surveys, and what they are made of.
struct Surveys<'a> {
    folder: &'a Path,
    program: &'a Path,
}

impl Surveys<'_> {
    fn write(&self) -> Outcome {
        let small = "width: 66, height: 54, pixel_pitch_mm: (0.1, 0.1)";
        let room = "width: 176, height: 144, pixel_pitch_mm: (0.04, 0.04)";
        self.simulate("repeats", [small, "width: 640, height: 480, pixel_pitch_mm: (0.0105, 0.0105)"], "walls")?;
        self.simulate("repeats", [small, room], "small")?;
        self.simulate("room", [room, "width: 640, height: 480, pixel_pitch_mm: (0.011, 0.011)"], "room")?;
        // Six walls with six frames each; eight stations in the room with eight.
        self.long("one station of 2,000", "walls", FRAMES, |frame| (0, frame % 6, 0))?;
        self.long("200 stations of 10", "walls", FRAMES, |frame| (frame / 10 % 6, frame % 6, frame / 10))?;
        self.long("2,000 stations of one, 176x144", "small", FRAMES, |frame| (frame % 6, frame / 6 % 6, frame))?;
        self.long("40 stations of one, a room", "room", 40, |frame| (frame % 8, frame / 8 % 8, frame))?;
        self.long("one station of 2,000, a room", "room", FRAMES, |frame| (0, frame % 8, 0))?;
        for (name, more) in [("cloud.ron", ""), ("joined.ron", ", Register(), Adjust()")] {
            let text = format!("(name: \"long\", stages: [{STAGES}{more}])");
            write(self.folder.join(name), text).map_err(|error| error.to_string())?;
        }
        Ok(())
    }

    /// A scene of the fixtures with another camera.
    fn simulate(&self, scene: &str, [from, to]: [&str; 2], name: &str) -> Outcome {
        let failed = |error: std::io::Error| format!("{scene}: {error}");
        let text = read_to_string(root().join(format!("fixtures/scenes/{scene}.ron"))).map_err(failed)?;
        let file = self.folder.join(format!("{name}.ron"));
        write(&file, text.replace(from, to)).map_err(failed)?;
        let mut command = Command::new(self.program);
        let status = command.args(["simulate", "--quiet", "--out", name]).arg(&file).current_dir(self.folder).status();
        let status = status.map_err(failed)?;
        if status.success() { Ok(()) } else { Err(format!("simulate {scene}: {status}")) }
    }

    /// A survey that names frames of another one: of which station and which of its frames, and as what station.
    fn long(&self, name: &str, of: &str, frames: usize, named: impl Fn(usize) -> (usize, usize, usize)) -> Outcome {
        let failed = |error: std::io::Error| format!("{name}: {error}");
        let (from, to) = (self.folder.join(of), self.folder.join(name));
        std::fs::create_dir(&to).map_err(failed)?;
        std::fs::copy(from.join("calibration.ron"), to.join("calibration.ron")).map_err(failed)?;
        let text = read_to_string(from.join("survey.ron")).map_err(failed)?;
        let head = text.split("    frames: [").next().unwrap_or_default();
        let poses = read_to_string(from.join("stations.csv")).map_err(failed)?;
        let poses: Vec<&str> = poses.lines().collect();
        let mut rows: Vec<String> = poses.first().map(|header| (*header).to_owned()).into_iter().collect();
        let (mut entries, mut known) = (Vec::with_capacity(frames), 0);
        for frame in 0..frames {
            let (station, number, own) = named(frame);
            let time = 0.1 * frame as f64;
            entries.push(format!(
                "(file: \"../{of}/frames/{station:03}_{number}.npz\", station: \"L{own}\", timestamp_s: {time:.1}),"
            ));
            if own == known {
                let pose = poses.get(station + 1).and_then(|row| row.split_once(',')).map_or("", |(_, pose)| pose);
                rows.push(format!("L{own},{pose}"));
                known += 1;
            }
        }
        write(to.join("survey.ron"), format!("{head}    frames: [\n{}\n    ],\n)\n", entries.join("\n")))
            .map_err(failed)?;
        write(to.join("stations.csv"), rows.join("\n") + "\n").map_err(failed)
    }
}
