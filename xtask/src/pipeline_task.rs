//! `cargo xtask pipeline NAME`: the pipelines of the repository, by name.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;

use crate::shell::{rangecam, root};

/// Which pipeline to run.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// A file of fixtures/pipelines without its ending.
    name: String,
    /// Output folder; default: out/NAME of the repository.
    #[arg(long, short)]
    out: Option<PathBuf>,
    /// Further arguments for `rangecam run`.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    more: Vec<OsString>,
}

impl Arguments {
    /// The arguments of `rangecam` that run the pipeline of this file.
    fn line(&self, file: PathBuf) -> Vec<OsString> {
        let mut line: Vec<OsString> = vec!["run".into(), "--pipeline".into(), file.into()];
        // What is behind the first argument that this task does not know goes to `rangecam` as it stands.
        let mut names_out = self.more.iter().filter_map(|argument| argument.to_str());
        if !names_out.any(|argument| argument.starts_with("--out") || argument.starts_with("-o")) {
            let out = self.out.clone().unwrap_or_else(|| root().join("out").join(&self.name));
            line.extend(["--out".into(), out.into()]);
        }
        line.extend(self.more.iter().cloned());
        line
    }
}

pub(crate) fn run(arguments: &Arguments) -> ExitCode {
    let pipelines = root().join("fixtures/pipelines");
    let file = pipelines.join(format!("{}.ron", arguments.name));
    if !file.is_file() {
        eprintln!("there is no pipeline `{}`; there are: {}", arguments.name, names(&pipelines).join(", "));
        return ExitCode::from(2);
    }
    match rangecam(&arguments.line(file)) {
        Ok(code) => ExitCode::from(code),
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}

fn names(folder: &std::path::Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> =
        entries.filter_map(|entry| Some(entry.path().file_stem()?.to_string_lossy().into_owned())).collect();
    names.sort();
    names
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Task {
        #[command(flatten)]
        arguments: Arguments,
    }

    /// What goes to `rangecam` behind the pipeline's file.
    fn line(typed: &[&str]) -> Vec<String> {
        let task = Task::try_parse_from([&["pipeline", "room"], typed].concat()).unwrap();
        let line = task.arguments.line("room.ron".into());
        line[3..].iter().map(|argument| argument.to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn further_arguments_are_handed_on() {
        let standard = root().join("out/room").display().to_string();
        assert_eq!(line(&[]), ["--out", &standard]);
        for typed in [["--out", "d"], ["-o", "d"]] {
            assert_eq!(line(&typed), ["--out", "d"]);
        }
        assert_eq!(line(&["--out=d", "--quiet"]), ["--out", "d", "--quiet"]);
        assert_eq!(line(&["--json", "--out", "d"]), ["--json", "--out", "d"]);
        assert_eq!(line(&["--", "-od"]), ["-od"]);
        assert_eq!(line(&["-c", "own.ron"]), ["--out", &standard, "-c", "own.ron"]);
    }
}
