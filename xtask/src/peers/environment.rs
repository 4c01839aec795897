//! Virtual environments with the peers, and programs that answer in figures.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::shell::{Outcome, root};

/// A virtual environment with the packages of `xtask/peers/<name>-requirements.txt`.
pub(crate) struct Environment {
    python: PathBuf,
    scripts: PathBuf,
}

impl Environment {
    /// As [`Self::new`]; where Python, its `venv` or the package index is missing, says so and answers nothing.
    pub(crate) fn if_possible(name: &str) -> Option<Self> {
        match Self::new(name) {
            Ok(environment) => Some(environment),
            Err(message) => {
                println!(
                    "── peers of {name}: not to be had, skipped; they need python3 with venv, and the Python Package \
                     Index once\n{message}"
                );
                None
            }
        }
    }

    /// Makes the environment, or finds it made from the same list.
    pub(crate) fn new(name: &str) -> Result<Self, String> {
        let scripts = root().join("xtask/peers");
        let list = scripts.join(format!("{name}-requirements.txt"));
        let folder = root().join("target/peers").join(name);
        let python = folder.join("bin/python");
        let installed = folder.join("installed.txt");
        let wanted = std::fs::read_to_string(&list).map_err(|error| format!("{}: {error}", list.display()))?;
        if std::fs::read_to_string(&installed).ok().as_deref() != Some(wanted.as_str()) {
            println!("── peers of {name}: {}", wanted.lines().collect::<Vec<_>>().join(", "));
            run(Command::new("python3").args(["-m", "venv", "--clear"]).arg(&folder))?;
            run(Command::new(&python).args(["-m", "pip", "install", "--quiet", "-r"]).arg(&list))?;
            std::fs::write(&installed, wanted).map_err(|error| format!("{}: {error}", installed.display()))?;
        }
        Ok(Self { python, scripts })
    }

    /// Runs a script; its last line is an object of JSON.
    pub(crate) fn call(&self, script: &str, arguments: &[&str]) -> Result<serde_json::Value, String> {
        let text = output(Command::new(&self.python).arg(self.scripts.join(script)).args(arguments))?;
        let line = text.lines().last().unwrap_or_default();
        serde_json::from_str(line).map_err(|error| format!("{script}: {error}: {line}"))
    }
}

/// An example of ours, built for speed.
pub(crate) struct Example(PathBuf);

impl Example {
    pub(crate) fn build(package: &str, name: &str) -> Result<Self, String> {
        Self::build_with(package, name, &[])
    }

    /// With these features of the package.
    pub(crate) fn build_with(package: &str, name: &str, features: &[&str]) -> Result<Self, String> {
        let features = features.join(",");
        let command =
            ["build", "--release", "--quiet", "--package", package, "--example", name, "--features", &features];
        crate::shell::cargo(&command, &[])?;
        let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from);
        Ok(Self(target.join("release/examples").join(name)))
    }

    /// Runs it on one thread and reads lines of `name figure...`; a name that comes again counts as well.
    pub(crate) fn call(&self, arguments: &[&str]) -> Result<Figures, String> {
        Ok(Figures::read(&output(Command::new(&self.0).args(arguments).env("RAYON_NUM_THREADS", "1"))?))
    }
}

/// What an example printed: by name, the figures of all lines that begin with it.
#[derive(Default)]
pub(crate) struct Figures(BTreeMap<String, Vec<Vec<f64>>>);

impl Figures {
    pub(crate) fn read(text: &str) -> Self {
        let mut figures = Self::default();
        for line in text.lines() {
            let mut words = line.split_whitespace();
            let Some(name) = words.next() else { continue };
            let values = words.filter_map(|word| word.parse().ok()).collect();
            figures.0.entry(name.to_owned()).or_default().push(values);
        }
        figures
    }

    /// A figure by name and place in its first line; NaN where there is none.
    pub(crate) fn get(&self, name: &str, place: usize) -> f64 {
        self.lines(name).first().and_then(|values| values.get(place)).copied().unwrap_or(f64::NAN)
    }

    /// How many lines begin with the name.
    pub(crate) fn count(&self, name: &str) -> usize {
        self.lines(name).len()
    }

    /// The figures of all lines that begin with the name.
    pub(crate) fn lines(&self, name: &str) -> &[Vec<f64>] {
        self.0.get(name).map_or(&[], Vec::as_slice)
    }
}

/// A real capture beside the project, if it is there.
pub(crate) fn capture(name: &str) -> Option<PathBuf> {
    let path = root().join("../shared/real").join(name);
    if path.exists() {
        return Some(path);
    }
    println!("── {name}: not here, skipped; its place is {}", path.display());
    None
}

pub(crate) fn text(path: &Path) -> String {
    path.display().to_string()
}

fn run(command: &mut Command) -> Outcome {
    output(command).map(|_| ())
}

fn output(command: &mut Command) -> Result<String, String> {
    let line = format!("{command:?}");
    let done = command.output().map_err(|error| format!("{line}: {error}"))?;
    if done.status.success() {
        return Ok(String::from_utf8_lossy(&done.stdout).into_owned());
    }
    Err(format!("{line}: {}\n{}", done.status, String::from_utf8_lossy(&done.stderr)))
}
