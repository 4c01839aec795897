//! Where a command writes: checked against everything that it reads before any work is done, and told of a refusal.

use std::collections::BTreeSet;
use std::fmt;
use std::path::{Component, Path, PathBuf};

use atomic_output::{Destination, write_text};
use range_io::calibration::Calibration;
use range_io::survey::Survey;
use serde::Serialize;

use crate::made::{self, Made};
use crate::verdict::Failure;
use crate::{Error, InputDigest, Result};

/// What a command reads, which its output must leave alone.
#[derive(Debug, Clone, Default)]
#[must_use]
pub struct Inputs {
    paths: BTreeSet<PathBuf>,
    /// Files in them that are not read.
    not_read: BTreeSet<PathBuf>,
}

impl Inputs {
    /// A survey: its folder with the calibration in it, and what it names outside of it.
    pub fn survey(mut self, path: &Path) -> Self {
        // Of what is not there the command itself says so; its parent is not read.
        let root = if path.exists() { root_of(path) } else { path.to_owned() };
        self.paths.insert(root.join(Calibration::FILE_NAME));
        // Of what can't be read the command itself says why.
        if let Ok(survey) = Survey::read(path) {
            let frames = survey.frames.iter().map(|frame| &frame.file);
            let truth = survey.truth.iter().flat_map(|truth| truth.frames.iter().chain(&truth.stations));
            for file in frames.chain(truth).chain(survey.extras.values()).map(|file| root.join(file)) {
                let leads_up = file.components().any(|part| part == Component::ParentDir);
                // A folder in the survey may be a link to another place.
                let input = if leads_up { Some(file.as_path()) } else { file.parent() };
                if let Some(input) = input.filter(|input| !self.paths.contains(*input)) {
                    self.paths.insert(input.to_owned());
                }
            }
        }
        self.paths.insert(root);
        self
    }

    /// A file or folder.
    pub fn path(mut self, path: impl AsRef<Path>) -> Self {
        self.paths.insert(path.as_ref().to_owned());
        self
    }

    /// A file or folder, where one is named.
    pub fn maybe(self, path: Option<&Path>) -> Self {
        path.into_iter().fold(self, Self::path)
    }

    /// Files in all of this that this part of the work does not read; the output must leave them alone all the same.
    pub fn not_read(mut self, files: impl IntoIterator<Item = PathBuf>) -> Self {
        self.not_read.extend(files);
        self
    }

    /// Digests of all files that are read, in the order of their names; hidden ones, and those that can't be read, are not among them.
    pub fn digests(&self) -> Vec<InputDigest> {
        let mut files = BTreeSet::new();
        for path in &self.paths {
            add_files(path, &mut files);
        }
        let files: Vec<&Path> = files.difference(&self.not_read).map(PathBuf::as_path).collect();
        made::digests(&files)
    }

    /// The place `out`, if it leaves all of this alone.
    pub fn destination(&self, out: &Path) -> Result<Destination> {
        let inputs: Vec<&PathBuf> = self.paths.iter().collect();
        Ok(Destination::new(out, &inputs)?)
    }
}

/// The file, or the files in a folder and its folders. What is not there, or can't be read, the command itself tells.
fn add_files(path: &Path, files: &mut BTreeSet<PathBuf>) {
    if path.is_file() {
        files.insert(path.to_owned());
    }
    for entry in std::fs::read_dir(path).into_iter().flatten().flatten() {
        let hidden = entry.file_name().to_string_lossy().starts_with('.');
        // A link to a folder might lead in a circle; one that is named is followed.
        let link_to_folder = entry.file_type().is_ok_and(|kind| kind.is_symlink()) && entry.path().is_dir();
        if !hidden && !link_to_folder {
            add_files(&entry.path(), files);
        }
    }
}

/// What is written of a refusal where there is no other summary.
#[derive(Debug, Serialize)]
struct Refusal {
    refused: String,
}

/// Where a refusal was written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RefusalFile {
    /// The file.
    pub file: PathBuf,
    /// Whether an older result stands in its folder.
    pub beside_result: bool,
}

/// Name of a refusal's file beside an older result, which stays.
const REFUSED: &str = "refused.json";

/// Name of a refusal's file, and of every result's figures.
const SUMMARY: &str = "summary.json";

/// Does a command's work, which writes its results to the destination that it is given. What the data refuse is written
/// there too: as `summary.json` and nothing else, or as `refused.json` beside an older result.
///
/// # Errors
/// [`Error::AlreadyDone`] where the caller wants outputs left alone that were made from the same; those of the work.
pub fn produce<T>(out: &Path, inputs: &Inputs, work: impl FnOnce(&Destination) -> Result<T>) -> Result<T> {
    let destination = inputs.destination(out)?;
    let made = made::options().map(|options| Made::new(options, &inputs.digests()));
    produce_made(&destination, made, work)
}

/// [`produce`] with a record of its own, `None` for none.
pub fn produce_made<T>(
    destination: &Destination,
    made: Option<Made>,
    work: impl FnOnce(&Destination) -> Result<T>,
) -> Result<T> {
    if made::is_done(destination, made.as_ref()) {
        return Err(Error::AlreadyDone { out: destination.named().to_owned() });
    }
    match made::recorded(made, || work(destination)) {
        Err(error) if error.failure() == Failure::Refused => Err(write_refusal(destination, error)?),
        done => done,
    }
}

/// The error with the place where its summary stands now.
fn write_refusal(destination: &Destination, error: Error) -> Result<Error> {
    let (summary, source) = match error {
        // A command below this one has written it already.
        Error::Refused { written: Some(_), .. } => return Ok(error),
        Error::Refused { summary, source, .. } => (summary, source),
        other => (json(&Refusal { refused: other.to_string() })?, other.into()),
    };
    let is_result = |file: &PathBuf| ![SUMMARY, REFUSED].iter().any(|name| file == Path::new(name));
    let beside_result = destination.older_files().iter().any(is_result);
    let folder = destination.open()?;
    if beside_result {
        folder.keep_older()?;
    }
    let name = if beside_result { REFUSED } else { SUMMARY };
    write_text(folder.file(name)?, &summary)?;
    folder.commit()?;
    let written = Some(RefusalFile { file: destination.named().join(name), beside_result });
    Ok(Error::Refused { summary, source, written })
}

/// A summary with the record of what it was made from.
#[derive(Serialize)]
struct Recorded<'a, S> {
    #[serde(flatten)]
    summary: &'a S,
    made: Made,
}

/// The text of a `summary.json`, with the record `made` where there is one.
pub fn json(summary: &impl Serialize) -> Result<String> {
    let text = match made::current() {
        Some(made) => serde_json::to_string_pretty(&Recorded { summary, made }),
        None => serde_json::to_string_pretty(summary),
    };
    text.map_err(|error| Error::Figure { figure: SUMMARY.to_owned(), message: error.to_string() })
}

impl fmt::Display for RefusalFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let older = if self.beside_result { "; the older result beside it stays" } else { "" };
        write!(f, "the refusal is in {}{older}", self.file.display())
    }
}

/// Refuses a name that can't be that of a folder: the output folder is called after it.
pub fn check_name(path: &Path, name: &str) -> Result<()> {
    let refused = |reason| Err(Error::Name { path: path.to_owned(), field: "name", value: name.to_owned(), reason });
    match name {
        "" => refused("expected a name, as the output folder is called after it"),
        "." | ".." => refused("which is a folder already: expected a name of its own"),
        _ if name.contains(char::is_control) => refused("expected a name without control characters"),
        _ if name.contains(['/', '\\']) => refused("expected a name without `/` and `\\`: it is no path"),
        _ if name.len() > LONGEST_NAME => refused("which is longer than 200 bytes: expected a shorter name"),
        _ => Ok(()),
    }
}

/// Bytes of a name: file systems take 255, and endings are put to it.
const LONGEST_NAME: usize = 200;

/// The folder that a survey's paths are relative to, whether the folder or its `survey.ron` was named.
pub fn root_of(survey: &Path) -> PathBuf {
    if survey.is_dir() { survey.to_owned() } else { survey.parent().unwrap_or(Path::new("")).to_owned() }
}
