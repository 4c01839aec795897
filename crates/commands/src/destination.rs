//! Where a command writes: checked against everything that it reads before any work is done, and told of a refusal.

use std::collections::BTreeSet;
use std::fmt;
use std::path::{Component, Path, PathBuf};

use atomic_output::{Destination, write_text};
use range_io::calibration::Calibration;
use range_io::survey::Survey;
use serde::Serialize;

use crate::verdict::Failure;
use crate::{Error, Result};

/// What a command reads, which its output must leave alone.
#[derive(Debug, Clone, Default)]
#[must_use]
pub struct Inputs(BTreeSet<PathBuf>);

impl Inputs {
    /// A survey: its folder with the calibration in it, and what it names outside of it.
    pub fn survey(mut self, path: &Path) -> Self {
        // Of what is not there the command itself says so; its parent is not read.
        let root = if path.exists() { root_of(path) } else { path.to_owned() };
        self.0.insert(root.join(Calibration::FILE_NAME));
        // Of what can't be read the command itself says why.
        if let Ok(survey) = Survey::read(path) {
            let frames = survey.frames.iter().map(|frame| &frame.file);
            let truth = survey.truth.iter().flat_map(|truth| truth.frames.iter().chain(&truth.stations));
            for file in frames.chain(truth).chain(survey.extras.values()).map(|file| root.join(file)) {
                let leads_up = file.components().any(|part| part == Component::ParentDir);
                // A folder in the survey may be a link to another place.
                let input = if leads_up { Some(file.as_path()) } else { file.parent() };
                if let Some(input) = input.filter(|input| !self.0.contains(*input)) {
                    self.0.insert(input.to_owned());
                }
            }
        }
        self.0.insert(root);
        self
    }

    /// A file or folder.
    pub fn path(mut self, path: impl AsRef<Path>) -> Self {
        self.0.insert(path.as_ref().to_owned());
        self
    }

    /// A file or folder, where one is named.
    pub fn maybe(self, path: Option<&Path>) -> Self {
        path.into_iter().fold(self, Self::path)
    }

    /// The place `out`, if it leaves all of this alone.
    pub fn destination(&self, out: &Path) -> Result<Destination> {
        let inputs: Vec<&PathBuf> = self.0.iter().collect();
        Ok(Destination::new(out, &inputs)?)
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
pub fn produce<T>(out: &Path, inputs: &Inputs, work: impl FnOnce(&Destination) -> Result<T>) -> Result<T> {
    let destination = inputs.destination(out)?;
    match work(&destination) {
        Err(error) if error.failure() == Failure::Refused => Err(write_refusal(&destination, error)?),
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

/// The text of a `summary.json`.
pub fn json(summary: &impl Serialize) -> Result<String> {
    serde_json::to_string_pretty(summary)
        .map_err(|error| Error::Figure { figure: SUMMARY.to_owned(), message: error.to_string() })
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
