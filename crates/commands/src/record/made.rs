//! What an output was made from: the program, its options, and the digests of all that it read. It stands as `made` in every
//! `summary.json`, and an output whose record is that of what would be made now need not be made again.
//!
//! How the program was called is known where its arguments are read and wanted where a summary is written, with twenty commands
//! in between that have nothing to do with it: it is kept per thread, from [`called`] to the end of its work. Without it
//! nothing is recorded and no file is read for it.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::OnceLock;
use std::time::Instant;

use atomic_output::{Destination, OutputFolder};
use rayon::prelude::*;
use serde::Serialize;
use sha2::{Digest, Sha256};

use crate::InputDigest;

/// How the program was called.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Call {
    /// The arguments that the result depends on, in their order; not the output folder.
    pub options: Vec<String>,
    /// Leave an output alone that was made from the same inputs with the same options by the same program.
    pub skip_done: bool,
    /// Leave durations out of summaries and reports, so that the same input gives the same bytes.
    pub no_times: bool,
}

/// The record of an output.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Made {
    /// Version of the program.
    pub version: &'static str,
    /// SHA-256 of the program's file.
    pub program_sha256: String,
    /// The arguments that the result depends on.
    pub options: Vec<String>,
    /// What was read, folder by folder.
    pub inputs: Vec<FolderDigest>,
    /// SHA-256 of all of this: outputs with one digest were made from the same.
    pub digest: String,
}

/// The files of a folder that were read.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FolderDigest {
    /// The folder, by the name under which it was read.
    pub folder: String,
    /// Files in it, without those in its folders.
    pub files: usize,
    /// Their length together.
    pub bytes: u64,
    /// SHA-256 of their names, lengths and SHA-256 in the order of the names, one file a line.
    pub sha256: String,
}

thread_local! {
    static CALL: RefCell<Option<Call>> = const { RefCell::new(None) };
    static MADE: RefCell<Vec<Option<Made>>> = const { RefCell::new(Vec::new()) };
}

/// Works with what is known of how the program was called.
pub fn called<T>(call: Call, work: impl FnOnce() -> T) -> T {
    let before = CALL.replace(Some(call));
    let done = work();
    CALL.set(before);
    done
}

/// Works on what a later step needs in any case: nothing is left out as done already.
pub fn anew<T>(work: impl FnOnce() -> T) -> T {
    match CALL.with_borrow(Clone::clone) {
        Some(call) => called(Call { skip_done: false, ..call }, work),
        None => work(),
    }
}

/// Seconds since then, for a summary; 0 where durations are to be left out.
pub fn seconds_since(start: Instant) -> f64 {
    if without_times() { 0.0 } else { start.elapsed().as_secs_f64() }
}

/// Whether durations are to be left out.
pub fn without_times() -> bool {
    CALL.with_borrow(|call| call.as_ref().is_some_and(|call| call.no_times))
}

/// The arguments that the result depends on; `None` where nothing is recorded.
pub fn options() -> Option<Vec<String>> {
    CALL.with_borrow(|call| call.as_ref().map(|call| call.options.clone()))
}

/// The record of the output that is at work.
pub(crate) fn current() -> Option<Made> {
    MADE.with_borrow(|made| made.last().cloned().flatten())
}

/// Works on an output with its record; whether one is at work already.
pub(crate) fn recorded<T>(made: Option<Made>, work: impl FnOnce() -> T) -> T {
    MADE.with_borrow_mut(|all| all.push(made));
    let done = work();
    MADE.with_borrow_mut(Vec::pop);
    done
}

/// Whether the output there is complete and has this record, and the caller wants such outputs left alone. What a work in
/// progress makes on its way is always made.
pub(crate) fn is_done(destination: &Destination, made: Option<&Made>) -> bool {
    let wanted = CALL.with_borrow(|call| call.as_ref().is_some_and(|call| call.skip_done));
    let outermost = MADE.with_borrow(Vec::is_empty);
    let Some(made) = made.filter(|_| wanted && outermost) else { return false };
    let files = destination.older_files();
    // A refusal is a summary by itself.
    let has_results =
        files.iter().any(|file| !["summary.json", "refused.json"].iter().any(|name| file == Path::new(name)));
    has_results
        && !files.iter().any(|file| file == Path::new("refused.json"))
        && all_there(destination)
        && recorded_digest(&destination.target().join("summary.json")).as_ref() == Some(&made.digest)
}

/// Whether every file that the output lists is there.
fn all_there(destination: &Destination) -> bool {
    let marker = fs::read_to_string(destination.target().join(OutputFolder::MARKER)).unwrap_or_default();
    let mut listed = marker.lines().skip(1).peekable();
    listed.peek().is_some() && listed.all(|file| destination.older_files().iter().any(|found| found == Path::new(file)))
}

/// The digest in a `summary.json`.
fn recorded_digest(summary: &Path) -> Option<String> {
    let value: serde_json::Value = serde_json::from_str(&fs::read_to_string(summary).ok()?).ok()?;
    value.pointer("/made/digest")?.as_str().map(str::to_owned)
}

impl Made {
    /// The record of what these options make of these files.
    pub fn new(options: Vec<String>, files: &[InputDigest]) -> Self {
        let mut folders: BTreeMap<String, Vec<&InputDigest>> = BTreeMap::new();
        for file in files {
            let folder = Path::new(&file.file).parent().unwrap_or(Path::new(""));
            folders.entry(folder.display().to_string()).or_default().push(file);
        }
        let inputs: Vec<FolderDigest> =
            folders.into_iter().map(|(folder, files)| folder_digest(folder, files)).collect();
        let (version, program_sha256) = (env!("CARGO_PKG_VERSION"), program_sha256());
        let mut hasher = Sha256::new();
        let mut add = |part: &str| {
            hasher.update((part.len() as u64).to_le_bytes());
            hasher.update(part);
        };
        [version, &program_sha256].into_iter().chain(options.iter().map(String::as_str)).for_each(&mut add);
        for input in &inputs {
            add(&input.folder);
            add(&input.sha256);
        }
        let digest = format!("{:x}", hasher.finalize());
        Self { version, program_sha256, options, inputs, digest }
    }
}

/// Version and digest of the program that runs.
pub fn program() -> String {
    format!("{} {}", env!("CARGO_PKG_VERSION"), program_sha256())
}

fn folder_digest(folder: String, mut files: Vec<&InputDigest>) -> FolderDigest {
    files.sort_by(|a, b| a.file.cmp(&b.file));
    files.dedup_by(|a, b| a.file == b.file);
    let mut hasher = Sha256::new();
    for file in &files {
        let name = Path::new(&file.file).file_name().unwrap_or_default().to_string_lossy();
        hasher.update(format!("{name} {} {}\n", file.bytes, file.sha256));
    }
    let bytes = files.iter().map(|file| file.bytes).sum();
    FolderDigest { folder, files: files.len(), bytes, sha256: format!("{:x}", hasher.finalize()) }
}

/// SHA-256 of the program that runs: two builds of one version may compute different bits. "unknown" where its file can't be read.
fn program_sha256() -> String {
    static PROGRAM: OnceLock<String> = OnceLock::new();
    let read = || {
        let file = std::env::current_exe().ok()?;
        Some(InputDigest::of(file).ok()?.sha256)
    };
    PROGRAM.get_or_init(|| read().unwrap_or_else(|| "unknown".to_owned())).clone()
}

/// Digests of files, in their order; a command that needs one that can't be read says so itself. Recordings are gigabytes: several are
/// read at once.
pub(crate) fn digests(files: &[&Path]) -> Vec<InputDigest> {
    files.par_iter().filter_map(|file| InputDigest::of(file).ok()).collect()
}
