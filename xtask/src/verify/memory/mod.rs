//! `cargo xtask verify memory`: how much memory the commands that read many frames take on long surveys, and how long.
//!
//! Surveys name the frames of simulated ones again and again. Each command must stay below [`MOST_MB`]; what it says of such
//! surveys is not asked: doubts, refusals and results in part all count as done. What grows with the number of frames is told by small
//! frames (`growth`).

mod growth;
mod process;
mod surveys;

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::shell::{Outcome, cargo, root};
use process::{Taken, watched};
use surveys::Surveys;

/// Largest resident set that is allowed, megabyte, and as the commands are told.
const MOST_MB: u64 = 2000;
const MEMORY: &str = "2GB";
/// Frames of a long survey.
const FRAMES: usize = 2000;

/// What is measured.
#[derive(Debug, Clone, Default, clap::Args)]
pub(crate) struct Options {
    /// Of `memory`: beside the lengths by which growth is told, surveys of so many small frames; 100000 takes two hours.
    #[arg(long)]
    frames: Option<usize>,
    /// Of `memory`: those alone of which this is a part, as in `noise on stations of 10`.
    #[arg(long, default_value = "")]
    only: String,
    /// Of `memory`: small frames alone.
    #[arg(long)]
    small: bool,
    /// Of `memory`: a program that is there already, instead of a release build.
    #[arg(long)]
    program: Option<PathBuf>,
}

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
    Case { survey: "a path of 2,000", command: &["register", "--track"] },
];

pub(crate) fn run(options: &Options) -> Outcome {
    let program = if let Some(program) = &options.program {
        // Commands run in the folder of the surveys.
        std::fs::canonicalize(program).map_err(|error| format!("{}: {error}", program.display()))?
    } else {
        cargo(&["build", "--release", "--package", "rangecam-cli", "--bin", "rangecam"], &[])?;
        let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from);
        target.join("release/rangecam")
    };
    let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
    let surveys = Surveys { folder: folder.path(), program: &program };
    surveys.write_plans()?;
    let mut beyond = growth::run(&surveys, options.frames, &options.only)?;
    if !options.small {
        surveys.write()?;
        println!("{:<32} {:<20} {:>10} {:>12}  exit code", "survey of 640x480", "command", "most, MB", "processor, s");
        for case in CASES.iter().filter(|case| case.name().contains(&options.only)) {
            let Taken { most_mb, seconds, code } = case.run(&program, folder.path())?;
            let command = words(case.command);
            println!("{:<32} {command:<20} {most_mb:>10} {seconds:>12.1}  {code}", case.survey);
            if most_mb > MOST_MB {
                beyond.push(format!("{}: {most_mb} MB", case.name()));
            }
        }
    }
    if beyond.is_empty() { Ok(()) } else { Err(format!("more than is allowed: {}", beyond.join("; "))) }
}

fn words(command: &[&str]) -> String {
    command.join(" ").replace("--pipeline ", "")
}

impl Case {
    fn name(&self) -> String {
        format!("{} on {}", words(self.command), self.survey)
    }

    fn run(&self, program: &Path, folder: &Path) -> Result<Taken, String> {
        measured(program, folder, self.command, self.survey)
    }
}

/// What a command takes on a survey in the folder.
fn measured(program: &Path, folder: &Path, words: &[&str], survey: &str) -> Result<Taken, String> {
    let mut command = Command::new(program);
    command.args(words).args(["--quiet", "--memory", MEMORY, "--out", "out"]).arg(survey).current_dir(folder);
    let child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().map_err(|error| error.to_string())?;
    let (taken, output) = watched(child)?;
    // Done, doubtful, refused, in part.
    if [0, 1, 3, 5].contains(&taken.code) {
        return Ok(taken);
    }
    let said = String::from_utf8_lossy(&output.stderr);
    Err(format!("{} on {survey}: {}: {said}", words.join(" "), output.status))
}
