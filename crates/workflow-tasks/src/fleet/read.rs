//! Files that a workflow leaves: codes, logs, summaries.

use std::fs;
use std::path::{Path, PathBuf};

use commands::{Error, InputDigest, Result};
use serde_json::Value;

use super::Recorded;

/// Reads files of a folder and keeps the digests of what it read.
pub(crate) struct Reader<'a> {
    pub(crate) folder: &'a Path,
    pub(crate) read: Vec<InputDigest>,
}

impl Reader<'_> {
    /// Names in a folder, sorted; none where there is no such folder.
    pub(crate) fn names(&self, relative: &Path) -> Vec<String> {
        let entries = fs::read_dir(self.folder.join(relative)).into_iter().flatten().flatten();
        let mut names: Vec<String> = entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
        names.retain(|name| !name.starts_with('.'));
        names.sort();
        names
    }

    fn text(&mut self, relative: &Path) -> Result<Option<String>> {
        let path = self.folder.join(relative);
        if !path.is_file() {
            return Ok(None);
        }
        let text = fs::read_to_string(&path).map_err(|source| Error::Access { path: path.clone(), source })?;
        // Of a log, only what went into the report counts, and that is the reason of a step without a result.
        if path.extension().is_none_or(|ending| ending != "log") {
            self.read.push(InputDigest { file: relative.display().to_string(), ..InputDigest::of(&path)? });
        }
        Ok(Some(text))
    }

    /// How a step ended; `None` where it was not recorded.
    pub(crate) fn code(&mut self, step: &Path) -> Result<Option<Recorded>> {
        let name = format!("{}.code", step.display());
        let file = PathBuf::from("codes").join(&name);
        let Some(text) = self.text(&file)? else { return Ok(None) };
        let Ok(code) = text.trim().parse::<u8>() else {
            let message = format!("{}: holds no exit code: {:?}", self.folder.join(file).display(), text.trim());
            return Err(Error::Request { command: "fleet", message });
        };
        let reason = if has_result(code) { None } else { self.reason(step)? };
        Ok(Some(Recorded { code, reason }))
    }

    /// The last line of a log that says why.
    fn reason(&mut self, step: &Path) -> Result<Option<String>> {
        let log = self.text(&PathBuf::from("logs").join(format!("{}.log", step.display())))?.unwrap_or_default();
        let said = log.lines().rev().find_map(|line| line.strip_prefix("error: "));
        Ok(said.or_else(|| log.lines().next_back()).map(str::to_owned))
    }

    /// A JSON file; `None` where there is none, or nothing in it.
    pub(crate) fn json(&mut self, relative: &Path) -> Result<Option<Value>> {
        let Some(text) = self.text(relative)?.filter(|text| !text.trim().is_empty()) else { return Ok(None) };
        serde_json::from_str(&text).map(Some).map_err(|error| {
            let message = format!("{}: {error}", self.folder.join(relative).display());
            Error::Request { command: "fleet", message }
        })
    }
}

/// Whether a step that ended so has a result: done, doubtful, or done in part.
pub(crate) fn has_result(code: u8) -> bool {
    matches!(code, 0 | 1 | 5)
}
