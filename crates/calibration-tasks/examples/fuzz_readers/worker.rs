//! Reads damaged files one after the other; what is wrong with a reader is printed and the file kept.

use std::error::Error;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use super::chance::Chance;
use super::mutate::{mutated, with_checksums};
use super::seeds;
use super::targets::{TARGETS, Target};

/// Longest time that reading a small file may take the processor, second.
pub const LONGEST_S: f64 = 1.0;

/// What a run of cases is given.
#[derive(Debug, Clone)]
pub struct Run {
    pub seed: u64,
    /// The first case and how many.
    pub cases: std::ops::Range<u64>,
    /// Where the case at hand lies, so that it is there when the process ends.
    pub folder: PathBuf,
    /// The only target, if there is one.
    pub only: Option<String>,
}

/// A file that a reader did not stand.
#[derive(Debug)]
pub struct Finding {
    pub target: &'static str,
    pub case: u64,
    pub what: String,
    pub bytes: Vec<u8>,
}

/// Runs the cases.
pub fn run(run: &Run) -> Result<Vec<Finding>, Box<dyn Error>> {
    fs::create_dir_all(&run.folder)?;
    let wanted = |target: &&Target| run.only.as_ref().is_none_or(|only| only == target.name);
    let targets: Vec<&Target> = TARGETS.iter().filter(wanted).collect();
    let files: Vec<Vec<Vec<u8>>> =
        targets.iter().map(|target| seeds::of(target.name, &run.folder)).collect::<Result<_, _>>()?;
    let mut findings = Vec::new();
    for case in run.cases.clone() {
        let mut chance = Chance::new(run.seed, case);
        let which = chance.below(targets.len());
        let (Some(target), Some(files)) = (targets.get(which), files.get(which)) else { continue };
        let (Some(sound), Some(other)) = (chance.one_of(files), chance.one_of(files)) else { continue };
        let mut bytes = mutated(sound, other, target.text, &mut chance);
        with_checksums(target.name, &mut bytes);
        let file = run.folder.join(target.file);
        fs::write(&file, &bytes)?;
        fs::write(run.folder.join("case"), format!("{} {case}", target.name))?;
        if let Err(what) = judge(target, &file) {
            findings.push(Finding { target: target.name, case, what, bytes });
        }
        fs::remove_file(&file)?;
    }
    Ok(findings)
}

/// Whether a reader stands a file: it may take or refuse it, but not panic nor take long.
pub fn judge(target: &Target, file: &Path) -> Result<bool, String> {
    let before = processor_time_s();
    let read = catch_unwind(AssertUnwindSafe(|| (target.read)(file)));
    let taken = processor_time_s() - before;
    match read {
        Err(panic) => {
            let text = panic.downcast_ref::<String>().cloned();
            Err(format!(
                "panic: {}",
                text.or_else(|| panic.downcast_ref::<&str>().map(|s| (*s).to_owned())).unwrap_or_default()
            ))
        }
        Ok(_) if taken > LONGEST_S => Err(format!("took {taken:.1} s")),
        Ok(accepted) => Ok(accepted),
    }
}

/// Time that the processor spent on this thread; 0 where the system does not tell.
fn processor_time_s() -> f64 {
    let text = fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let nanoseconds = text.split_whitespace().next().and_then(|word| word.parse::<f64>().ok());
    nanoseconds.unwrap_or(0.0) * 1e-9
}
