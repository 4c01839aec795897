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
    /// Of `memory`: frames of 640x480 alone, and so many of them (2000 where this is not said); of 100000 one command takes up to two
    /// hours.
    #[arg(long, conflicts_with_all = ["small", "frames"])]
    large: Option<usize>,
    /// Of `memory`: a program that is there already, instead of a release build.
    #[arg(long)]
    program: Option<PathBuf>,
}

/// A command on surveys of a kind.
struct Case {
    survey: &'static str,
    command: &'static [&'static str],
    /// Frames beyond which it is not asked for: where all pairs of stations are tried, time grows with the square.
    most: usize,
}

const ALL: usize = usize::MAX;

const CASES: &[Case] = &[
    Case { survey: "one station", command: &["run", "--pipeline", "cloud.ron"], most: ALL },
    Case { survey: "stations of 10", command: &["run", "--pipeline", "cloud.ron"], most: ALL },
    Case { survey: "stations of one, 176x144", command: &["run", "--pipeline", "cloud.ron"], most: ALL },
    Case { survey: "stations in a room", command: &["run", "--pipeline", "joined.ron"], most: 40 },
    Case { survey: "one station", command: &["noise"], most: ALL },
    Case { survey: "stations of 10", command: &["noise"], most: ALL },
    Case { survey: "one station", command: &["fpn"], most: ALL },
    Case { survey: "stations of 10", command: &["fpn"], most: ALL },
    Case { survey: "a warming camera", command: &["warmup"], most: ALL },
    Case { survey: "a path", command: &["register", "--track"], most: ALL },
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
    let mut beyond = Vec::new();
    if options.large.is_none() {
        beyond.extend(growth::run(&surveys, options.frames, &options.only)?);
    }
    if !options.small {
        println!("{:<40} {:<20} {:>10} {:>12}  exit code", "survey of 640x480", "command", "most, MB", "processor, s");
        let asked: Vec<&Case> = CASES.iter().filter(|case| case.name().contains(&options.only)).collect();
        if asked.is_empty() {
            let names: Vec<String> = CASES.iter().map(Case::name).collect();
            return Err(format!("no case is called `{}`: {}", options.only, names.join(", ")));
        }
        for case in asked {
            let survey = surveys.large(case.survey, options.large.unwrap_or(FRAMES).min(case.most))?;
            let Taken { most_mb, seconds, code } = measured(&program, folder.path(), case.command, &survey)?;
            println!("{survey:<40} {:<20} {most_mb:>10} {seconds:>12.1}  {code}", words(case.command));
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
}

/// What a command takes on a survey in the folder.
fn measured(program: &Path, folder: &Path, words: &[&str], survey: &str) -> Result<Taken, String> {
    let mut command = Command::new(program);
    command.args(words).args(["--quiet", "--memory", MEMORY, "--out", "out"]).arg(survey).current_dir(folder);
    let child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().map_err(|error| error.to_string())?;
    let (taken, output) = watched(child)?;
    let said = String::from_utf8_lossy(&output.stderr);
    // Done, doubtful, refused, in part.
    if [0, 1, 3, 5].contains(&taken.code) {
        eprint!("{said}");
        return Ok(taken);
    }
    Err(format!("{} on {survey}: {}: {said}", words.join(" "), output.status))
}
