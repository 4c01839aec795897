//! `cargo xtask workflow`: the workflow of an archive of forty simulated recordings with real parts, Snakemake 9 on this machine alone
//! and then under Slurm: jobs are killed at random, Snakemake and Slurm's controller as well, and in the end every byte is held against
//! what one process after the other writes. What can't be installed here is skipped with a word.

mod archive;
mod engine;
mod serial;
mod slurm;
mod trouble;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use crate::shell::{Outcome, cargo, root};
use crate::workflow::engine::Engine;
use crate::workflow::slurm::Slurm;
use crate::workflow::trouble::Trouble;

/// What to run.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Program to run instead of one that is built now.
    #[arg(long)]
    program: Option<PathBuf>,
    /// Folder for all of it, kept; default: a temporary one that is removed. One that has been used before is not simulated anew.
    #[arg(long)]
    folder: Option<PathBuf>,
    /// Seconds between two jobs that are killed.
    #[arg(long, default_value_t = 3)]
    kill_every: u64,
    /// Leave Slurm out.
    #[arg(long)]
    no_slurm: bool,
    /// Leave Snakemake on this machine alone out.
    #[arg(long)]
    no_local: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Outcome {
    let temporary = tempfile::tempdir().map_err(|error| error.to_string())?;
    let folder = arguments.folder.clone().unwrap_or_else(|| temporary.path().to_owned());
    fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let Some(engine) = Engine::installed(&folder.join("python")) else { return Ok(()) };
    let program = match &arguments.program {
        Some(program) => program.clone(),
        None => built()?,
    };
    let flow = folder.join("flow");
    let expected = expected(&program, &folder, &flow)?;
    if !arguments.no_local {
        println!("── Snakemake on this machine");
        let local = folder.join("local");
        let trouble = Trouble::new(&local, &program, arguments.kill_every, None);
        compare(&expected, &local, &engine.run_to_the_end(&flow, &local, &[], trouble)?)?;
    }
    if arguments.no_slurm {
        return Ok(());
    }
    let Some(slurm) = Slurm::started(&folder.join("slurm")) else { return Ok(()) };
    println!("── Snakemake under Slurm");
    let cluster = folder.join("cluster");
    let trouble = Trouble::new(&cluster, &program, arguments.kill_every, Some(&slurm));
    let killed = engine.run_to_the_end(&flow, &cluster, &Slurm::options(), trouble)?;
    compare(&expected, &cluster, &killed)
}

/// Archive, workflow, and what one process after the other makes of it.
fn expected(program: &Path, folder: &Path, flow: &Path) -> Result<BTreeMap<PathBuf, Vec<u8>>, String> {
    if folder.join("serial/fleet").is_dir() {
        return contents(&folder.join("serial"));
    }
    println!("── forty recordings into {}", folder.display());
    archive::write(program, &folder.join("archive"))?;
    let [archive, out] = [&folder.join("archive"), flow].map(|path| path.display().to_string());
    call(program, folder, &["workflow", &archive, "--shards", "2", "--out", &out])?;
    Engine::set_program(flow, program)?;
    println!("── one process after the other");
    serial::run(program, folder)
}

/// The command, built as tests build it.
fn built() -> Result<PathBuf, String> {
    cargo(&["build", "--package", "rangecam-cli"], &[])?;
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from);
    Ok(target.join("debug/rangecam"))
}

/// Runs `rangecam`, which must end with a result.
pub(crate) fn call(program: &Path, folder: &Path, arguments: &[&str]) -> Outcome {
    let output = std::process::Command::new(program).args(arguments).current_dir(folder).output();
    let output = output.map_err(|error| format!("{}: {error}", program.display()))?;
    match output.status.code() {
        Some(0 | 1) => Ok(()),
        code => Err(format!("rangecam {}: {code:?}: {}", arguments.join(" "), String::from_utf8_lossy(&output.stderr))),
    }
}

/// The folders of a place where a workflow ran whose files must be the same, with their files.
pub(crate) fn contents(place: &Path) -> Result<BTreeMap<PathBuf, Vec<u8>>, String> {
    let mut found = BTreeMap::new();
    let mut pending: Vec<PathBuf> = ["results", "checks", "fleet"].iter().map(|name| place.join(name)).collect();
    while let Some(folder) = pending.pop() {
        let entries = fs::read_dir(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
        for entry in entries.flatten() {
            let path = entry.path();
            if path.is_dir() {
                pending.push(path);
            } else {
                let bytes = fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))?;
                let name = path.strip_prefix(place).map_err(|error| error.to_string())?;
                found.insert(name.to_owned(), bytes);
            }
        }
    }
    Ok(found)
}

fn compare(expected: &BTreeMap<PathBuf, Vec<u8>>, place: &Path, killed: &str) -> Outcome {
    let found = contents(place)?;
    let names = |a: &BTreeMap<PathBuf, Vec<u8>>, b: &BTreeMap<PathBuf, Vec<u8>>| {
        let differs = |(name, bytes): &(&PathBuf, &Vec<u8>)| b.get(*name) != Some(*bytes);
        a.iter().filter(differs).map(|(name, _)| name.display().to_string()).collect::<Vec<_>>()
    };
    let (differing, unexpected) = (names(expected, &found), names(&found, expected));
    let bytes: usize = found.values().map(Vec::len).sum();
    if differing.is_empty() && unexpected.is_empty() {
        println!("── {} files, {bytes} bytes: the same as those of one process; {killed}", found.len());
        return Ok(());
    }
    Err(format!("{}: {} files differ: {differing:?} {unexpected:?}; {killed}", place.display(), differing.len()))
}
