//! Outputs that are never half: written beside their place and renamed into it.
//!
//! A crash of the program at any moment leaves the older output or the new one, not a mixture. (A loss of power may
//! still cost what the operating system had not written to disk.)

use std::fs::{self, File};
use std::io::{BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::{Error, Result};

/// A file that appears under its name at [`FileWriter::commit`] and not before.
///
/// Dropped without commit, it removes what it wrote, and an older file of the name stands untouched.
#[derive(Debug)]
pub struct FileWriter {
    target: PathBuf,
    temporary: PathBuf,
    writer: Option<BufWriter<File>>,
}

impl FileWriter {
    /// Opens a temporary file in the folder of `path`, which must exist.
    pub fn create(path: impl AsRef<Path>) -> Result<Self> {
        let target = path.as_ref().to_path_buf();
        if target.is_dir() {
            return Err(Error::format(&target, "is a folder, expected the name of a file to write"));
        }
        let temporary = sibling(&target, "partial")?;
        let file = File::options()
            .read(true)
            .write(true)
            .create_new(true)
            .open(&temporary)
            .map_err(Error::io(&target, "create a temporary file beside it"))?;
        Ok(Self { target, temporary, writer: Some(BufWriter::with_capacity(1 << 16, file)) })
    }

    /// The name the file will have.
    pub fn path(&self) -> &Path {
        &self.target
    }

    /// Writes what is buffered and gives the file its name, in place of an older one.
    pub fn commit(mut self) -> Result<()> {
        if let Some(mut writer) = self.writer.take() {
            writer.flush().map_err(Error::io(&self.target, "write"))?;
        }
        fs::rename(&self.temporary, &self.target).map_err(Error::io(&self.target, "rename the finished file to it"))
    }

    fn open(&mut self) -> std::io::Result<&mut BufWriter<File>> {
        self.writer.as_mut().ok_or_else(|| std::io::Error::other("the file was committed"))
    }
}

impl Write for FileWriter {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.open()?.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.open()?.flush()
    }
}

impl Read for FileWriter {
    /// Reads back what was written, from the current position.
    fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
        let writer = self.open()?;
        writer.flush()?;
        writer.get_mut().read(bytes)
    }
}

impl Seek for FileWriter {
    fn seek(&mut self, position: SeekFrom) -> std::io::Result<u64> {
        self.open()?.seek(position)
    }
}

impl Drop for FileWriter {
    fn drop(&mut self) {
        self.writer = None;
        // After a commit there is nothing of this name; before it, an error here can only leave the temporary behind.
        let _ = fs::remove_file(&self.temporary);
    }
}

/// Writes a text file as a whole.
pub fn write_text(path: impl AsRef<Path>, text: &str) -> Result<()> {
    let mut writer = FileWriter::create(path)?;
    writer.write_all(text.as_bytes()).map_err(Error::io(&writer.target, "write"))?;
    writer.commit()
}

/// A folder of results that appears under its name at [`OutputFolder::commit`] and not before.
///
/// Files are written into [`OutputFolder::path`]. The commit puts a file [`OutputFolder::MARKER`] in; only folders that
/// carry it, or are empty, are ever replaced, so that a slip in a path does not cost anyone a folder of other things.
/// Dropped without commit, it removes what it wrote, and an older output stands untouched.
#[derive(Debug)]
pub struct OutputFolder {
    target: PathBuf,
    temporary: PathBuf,
    committed: bool,
}

impl OutputFolder {
    /// Name of the file that marks a folder as a complete output.
    pub const MARKER: &str = ".complete";

    /// Makes a temporary folder beside `path`; missing parents are made too.
    pub fn create(path: impl AsRef<Path>) -> Result<Self> {
        // Without a trailing `/.` or the like the last component is the folder's name.
        let target: PathBuf = path.as_ref().components().collect();
        if let Some(parent) = target.parent() {
            fs::create_dir_all(parent).map_err(Error::io(parent, "create the folder"))?;
        }
        let replaced = replaced_name(&target)?;
        if !target.exists() && replaced.is_dir() {
            // A commit was cut off between its two renames: the older output is still whole.
            fs::rename(&replaced, &target).map_err(Error::io(&target, "restore the older output"))?;
        }
        require_replaceable(&target)?;
        let temporary = sibling(&target, "partial")?;
        fs::create_dir(&temporary).map_err(Error::io(&target, "create a temporary folder beside it"))?;
        Ok(Self { target, temporary, committed: false })
    }

    /// The temporary folder to write into.
    pub fn path(&self) -> &Path {
        &self.temporary
    }

    /// The name the folder will have.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// A path in the temporary folder, with its parent folders made.
    pub fn file(&self, relative: impl AsRef<Path>) -> Result<PathBuf> {
        let path = self.temporary.join(relative);
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent).map_err(Error::io(parent, "create the folder"))?;
        }
        Ok(path)
    }

    /// Gives the folder its name, in place of an older output.
    pub fn commit(mut self) -> Result<()> {
        let marker = self.temporary.join(Self::MARKER);
        fs::write(&marker, "This folder is written and replaced as a whole.\n").map_err(Error::io(&marker, "write"))?;
        require_replaceable(&self.target)?;
        let replaced = replaced_name(&self.target)?;
        if replaced.is_dir() {
            fs::remove_dir_all(&replaced).map_err(Error::io(&replaced, "remove what an earlier run left"))?;
        }
        let older = self.target.exists();
        if older {
            fs::rename(&self.target, &replaced).map_err(Error::io(&self.target, "move the older output aside"))?;
        }
        if let Err(source) = fs::rename(&self.temporary, &self.target) {
            if older {
                fs::rename(&replaced, &self.target).map_err(Error::io(&self.target, "restore the older output"))?;
            }
            return Err(Error::io(&self.target, "rename the finished folder to it")(source));
        }
        self.committed = true;
        if older {
            fs::remove_dir_all(&replaced).map_err(Error::io(&replaced, "remove the older output"))?;
        }
        Ok(())
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        if !self.committed {
            // Nothing can be done about an error here but leave the temporary folder behind.
            let _ = fs::remove_dir_all(&self.temporary);
        }
    }
}

fn require_replaceable(target: &Path) -> Result<()> {
    if !target.exists() {
        return Ok(());
    }
    if !target.is_dir() {
        return Err(Error::format(target, "is a file, expected the name of an output folder"));
    }
    let empty = fs::read_dir(target).map_err(Error::io(target, "list the folder"))?.next().is_none();
    if empty || target.join(OutputFolder::MARKER).is_file() {
        return Ok(());
    }
    Err(Error::format(
        target,
        format!(
            "exists and is no earlier output (it has no file `{}`); name another folder, or empty this one",
            OutputFolder::MARKER
        ),
    ))
}

fn replaced_name(target: &Path) -> Result<PathBuf> {
    Ok(target.with_file_name(format!(".{}.replaced", file_name(target)?)))
}

/// A name in the same folder that no other writer uses at the same time.
fn sibling(target: &Path, purpose: &str) -> Result<PathBuf> {
    static COUNTER: AtomicU64 = AtomicU64::new(0);
    let count = COUNTER.fetch_add(1, Ordering::Relaxed);
    let process = std::process::id();
    Ok(target.with_file_name(format!(".{}.{purpose}-{process}-{count}", file_name(target)?)))
}

fn file_name(target: &Path) -> Result<String> {
    let name = target.file_name().ok_or_else(|| Error::format(target, "has no name of its own to write to"))?;
    Ok(name.to_string_lossy().into_owned())
}
