//! `cargo xtask pipeline NAME`: the pipelines of the repository, by name.

use std::ffi::OsString;
use std::process::ExitCode;

use crate::shell::{rangecam, root};

/// Which pipeline to run.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// A file of fixtures/pipelines without its ending.
    name: String,
    /// Further arguments for `rangecam run`.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    more: Vec<OsString>,
}

pub(crate) fn run(arguments: &Arguments) -> ExitCode {
    let pipelines = root().join("fixtures/pipelines");
    let file = pipelines.join(&arguments.name).with_extension("ron");
    if !file.is_file() {
        eprintln!("there is no pipeline `{}`; there are: {}", arguments.name, names(&pipelines).join(", "));
        return ExitCode::from(2);
    }
    let out = root().join("out").join(&arguments.name);
    let mut line: Vec<OsString> = vec!["run".into(), "--pipeline".into(), file.into(), "--out".into(), out.into()];
    line.extend(arguments.more.iter().cloned());
    match rangecam(&line) {
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
