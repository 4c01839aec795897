//! Snakemake 9 in a virtual environment outside of the tree, started again for as long as it is killed.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::time::Duration;

use crate::shell::Outcome;
use crate::workflow::trouble::Trouble;

const PACKAGES: [&str; 2] = ["snakemake>=9,<10", "snakemake-executor-plugin-slurm"];

/// How often it is started before it must have come to the end: killed on purpose, and after jobs that failed too often.
const STARTS: usize = 12;

/// The engine.
pub(crate) struct Engine {
    snakemake: PathBuf,
    /// Where it keeps what it remembers of sources.
    cache: PathBuf,
}

impl Engine {
    /// Installs it; says why where that can't be done.
    pub(crate) fn installed(folder: &Path) -> Option<Self> {
        let snakemake = folder.join("bin/snakemake");
        let engine = || Some(Self { snakemake: snakemake.clone(), cache: folder.join("cache") });
        if snakemake.is_file() {
            return engine();
        }
        println!("── installing {} into {}", PACKAGES.join(" and "), folder.display());
        let made = Command::new("python3").args(["-m", "venv"]).arg(folder).output();
        let installed = made.is_ok_and(|made| made.status.success()).then(|| {
            Command::new(folder.join("bin/python")).args(["-m", "pip", "install", "--quiet"]).args(PACKAGES).output()
        });
        match installed {
            Some(Ok(output)) if output.status.success() => engine(),
            _ => {
                println!(
                    "── skipped: Snakemake 9 can't be installed here; it needs python3 with venv, and the Python Package Index"
                );
                None
            }
        }
    }

    /// Writes into the configuration which program is run.
    pub(crate) fn set_program(flow: &Path, program: &Path) -> Outcome {
        let file = flow.join("config.yaml");
        let fail = |error: std::io::Error| format!("{}: {error}", file.display());
        let program = fs::canonicalize(program).map_err(fail)?;
        let text = fs::read_to_string(&file).map_err(fail)?;
        let line = |line: &str| match line.strip_prefix("rangecam: ") {
            Some(_) => format!("rangecam: {}\n", program.display()),
            None => format!("{line}\n"),
        };
        fs::write(&file, text.lines().map(line).collect::<String>()).map_err(fail)
    }

    /// Runs the workflow in the midst of trouble, until it has come to its end; in words, what happened on the way.
    pub(crate) fn run_to_the_end(
        &self,
        flow: &Path,
        place: &Path,
        options: &[String],
        mut trouble: Trouble<'_>,
    ) -> Result<String, String> {
        for start in 1..=STARTS {
            let mut unlock = self.command(flow, place, &[])?;
            unlock.arg("--unlock");
            // Nothing is locked at the first start.
            let _ = unlock.output();
            let mut engine =
                self.command(flow, place, options)?.spawn().map_err(|error| format!("snakemake: {error}"))?;
            if watched(&mut engine, &mut trouble)? {
                return Ok(format!("{}; {start} starts of Snakemake", trouble.in_words()));
            }
        }
        Err(format!("{}: not at its end after {STARTS} starts: see snakemake.log there", place.display()))
    }

    fn command(&self, flow: &Path, place: &Path, options: &[String]) -> Result<Command, String> {
        let fail = |error: std::io::Error| format!("{}: {error}", place.display());
        fs::create_dir_all(place).map_err(fail)?;
        let log = File::options().create(true).append(true).open(place.join("snakemake.log")).map_err(fail)?;
        let mut command = Command::new(&self.snakemake);
        command.arg("--snakefile").arg(flow.join("Snakefile")).arg("--directory").arg(place);
        let profile = if options.is_empty() { "local" } else { "slurm" };
        command.arg("--profile").arg(flow.join("profiles").join(profile)).args(options);
        let bin = self.snakemake.parent().unwrap_or(Path::new("")).display().to_string();
        let path = std::env::var("PATH").unwrap_or_default();
        command.env("XDG_CACHE_HOME", &self.cache).env("PATH", format!("{bin}:{path}"));
        command.stdout(log.try_clone().map_err(fail)?).stderr(log);
        Ok(command)
    }
}

/// Makes trouble until the engine ends; whether it came to the end of the workflow.
fn watched(engine: &mut Child, trouble: &mut Trouble<'_>) -> Result<bool, String> {
    loop {
        if let Some(status) = engine.try_wait().map_err(|error| format!("snakemake: {error}"))? {
            return Ok(status.success());
        }
        std::thread::sleep(Duration::from_millis(200));
        trouble.make(engine)?;
    }
}
