//! What a folder of results holds by its own list, and by what lies in it.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::{Error, Result};

/// Name of the file that marks a folder as a complete output and lists its files.
pub(crate) const MARKER: &str = ".complete";

/// First line of the marker.
const HEAD: &str = "This folder is written and replaced as a whole: then these files are removed, and no others.";

/// Largest marker that is read, bytes: some hundred thousand files.
const LARGEST_MARKER: u64 = 1 << 26;

/// Files and folders below a folder, relative to it and sorted. Links count as files and are not followed.
#[derive(Debug, Default)]
pub(crate) struct Contents {
    pub(crate) files: BTreeSet<PathBuf>,
    pub(crate) folders: BTreeSet<PathBuf>,
}

impl Contents {
    /// What lies in a folder.
    pub(crate) fn of(folder: &Path) -> io::Result<Self> {
        let mut contents = Self::default();
        contents.add(folder, Path::new(""))?;
        Ok(contents)
    }

    fn add(&mut self, root: &Path, relative: &Path) -> io::Result<()> {
        for entry in fs::read_dir(root.join(relative))? {
            let entry = entry?;
            let path = relative.join(entry.file_name());
            if entry.file_type()?.is_dir() {
                self.add(root, &path)?;
                self.folders.insert(path);
            } else {
                self.files.insert(path);
            }
        }
        Ok(())
    }

    /// The marker's text: one file a line. The name of a file that can't stand in a line is given instead.
    pub(crate) fn marker(&self) -> std::result::Result<String, PathBuf> {
        let mut text = format!("{HEAD}\n");
        for file in &self.files {
            let parts: Option<Vec<&str>> = file.iter().map(|part| part.to_str()).collect();
            let line = parts.map(|parts| parts.join("/")).filter(|line| !line.contains(char::is_control));
            text.push_str(&line.ok_or_else(|| file.clone())?);
            text.push('\n');
        }
        Ok(text)
    }
}

/// Files of an output as its marker lists them; nothing for an empty folder.
///
/// # Errors
/// Where the folder is no output, or holds what the output did not write: replacing it would cost someone that.
pub(crate) fn replaceable_files(folder: &Path) -> Result<Vec<PathBuf>> {
    let found = Contents::of(folder).map_err(Error::io(folder, "list the folder"))?;
    if found.files.is_empty() && found.folders.is_empty() {
        return Ok(Vec::new());
    }
    let refused = |reason: String| Err(Error::format(folder, reason));
    if !found.files.contains(Path::new(MARKER)) {
        return refused(format!(
            "exists and is no earlier output (it has no file `{MARKER}`); name another folder, or empty this one"
        ));
    }
    let marker = folder.join(MARKER);
    let data = fs::symlink_metadata(&marker).map_err(Error::io(&marker, "read"))?;
    if !data.is_file() || data.len() > LARGEST_MARKER {
        return refused(format!("holds a `{MARKER}` that is no list of files; name another folder"));
    }
    let text = fs::read_to_string(&marker).map_err(Error::io(&marker, "read"))?;
    let mut lines = text.lines();
    if lines.next() != Some(HEAD) {
        return refused(format!(
            "holds an output whose `{MARKER}` does not list its files, as of an earlier version: which of them may be \
             removed is not known; name another folder, or remove this one yourself"
        ));
    }
    let listed: BTreeSet<PathBuf> = lines.map(|line| line.split('/').collect()).collect();
    let other_file = found.files.iter().find(|file| **file != Path::new(MARKER) && !listed.contains(*file));
    let other_folder = || found.folders.iter().find(|folder| !listed.iter().any(|file| file.starts_with(folder)));
    if let Some(other) = other_file.or_else(other_folder) {
        return refused(format!(
            "holds `{}`, which the output there did not write and replacing it would remove; move it away, or name \
             another folder",
            other.display()
        ));
    }
    Ok(found.files.into_iter().filter(|file| file != Path::new(MARKER)).collect())
}

/// Removes an output: the files that it lists and the folders that they leave empty. What is gone already is no error.
///
/// # Errors
/// As [`replaceable_files`]; then nothing is removed.
pub(crate) fn remove(folder: &Path) -> Result<()> {
    replaceable_files(folder)?;
    let found = Contents::of(folder).map_err(Error::io(folder, "list the folder"))?;
    // The marker goes last of all files, so that a removal that is cut off can go on.
    let files = found.files.iter().filter(|file| *file != Path::new(MARKER)).map(|file| folder.join(file));
    for file in files.chain([folder.join(MARKER)]) {
        accept_missing(fs::remove_file(&file)).map_err(Error::io(&file, "remove"))?;
    }
    // A folder sorts before what lies in it.
    let folders = found.folders.iter().rev().map(|path| folder.join(path));
    for path in folders.chain([folder.to_owned()]) {
        accept_missing(fs::remove_dir(&path)).map_err(Error::io(&path, "remove"))?;
    }
    Ok(())
}

fn accept_missing(result: io::Result<()>) -> io::Result<()> {
    match result {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        other => other,
    }
}
