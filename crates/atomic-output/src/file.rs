//! One file.

use std::fs::{self, File};
use std::io::{BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::{disk, leftovers};
use crate::{Error, Result};

/// A file that appears under its name at [`FileWriter::commit`] and not before.
///
/// Dropped without commit, it removes what it wrote, and an older file of the name stands untouched. A program that is
/// killed leaves a file `.NAME.partial-*` beside it, which the next writer of this name removes.
#[derive(Debug)]
pub struct FileWriter {
    target: PathBuf,
    temporary: PathBuf,
    writer: Option<BufWriter<DiskFile>>,
}

impl FileWriter {
    /// Opens a temporary file in the folder of `path`, which must exist.
    pub fn create(path: impl AsRef<Path>) -> Result<Self> {
        let target = path.as_ref().to_path_buf();
        if target.is_dir() {
            return Err(Error::format(&target, "is a folder, expected the name of a file to write"));
        }
        if !leftovers::is_in_unfinished_folder(&target) {
            leftovers::remove_of(&target)?;
        }
        let temporary = leftovers::temporary_name(&target)?;
        let file = disk::create_file(&temporary).map_err(Error::io(&target, "create a temporary file beside it"))?;
        // So that another writer of this name sees that it is in use; where files can't be locked, its age tells.
        let _ = file.try_lock();
        Ok(Self { target, temporary, writer: Some(BufWriter::with_capacity(1 << 16, DiskFile(file))) })
    }

    /// The name the file will have.
    pub fn path(&self) -> &Path {
        &self.target
    }

    /// Writes what is buffered, to the disk, and gives the file its name, in place of an older one.
    ///
    /// In an [`OutputFolder`](super::OutputFolder) that is being written the folder's own commit brings all files to the
    /// disk.
    pub fn commit(mut self) -> Result<()> {
        let is_part = leftovers::is_in_unfinished_folder(&self.target);
        if let Some(mut writer) = self.writer.take() {
            writer.flush().map_err(Error::io(&self.target, "write"))?;
            if !is_part {
                disk::sync_file(&writer.get_ref().0).map_err(Error::io(&self.target, "bring to the disk"))?;
            }
        }
        disk::rename(&self.temporary, &self.target)
            .map_err(Error::io(&self.target, "rename the finished file to it"))?;
        match self.target.parent() {
            Some(folder) if !is_part => {
                // A name alone stands for the folder one is in.
                let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
                disk::sync_folder(folder).map_err(Error::io(folder, "bring the folder to the disk"))
            }
            _ => Ok(()),
        }
    }

    fn open(&mut self) -> std::io::Result<&mut BufWriter<DiskFile>> {
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
        writer.get_mut().0.read(bytes)
    }
}

impl Seek for FileWriter {
    fn seek(&mut self, position: SeekFrom) -> std::io::Result<u64> {
        self.open()?.seek(position)
    }
}

impl Drop for FileWriter {
    fn drop(&mut self) {
        if let Some(writer) = self.writer.take() {
            // What is still buffered is for nobody.
            drop(writer.into_parts());
        }
        // After a commit there is nothing of this name; before it, an error here can only leave the temporary behind.
        let _ = fs::remove_file(&self.temporary);
    }
}

/// A file whose writes go through [`disk`].
#[derive(Debug)]
struct DiskFile(File);

impl Write for DiskFile {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        disk::write(&mut self.0, bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.0.flush()
    }
}

impl Seek for DiskFile {
    fn seek(&mut self, position: SeekFrom) -> std::io::Result<u64> {
        self.0.seek(position)
    }
}

/// Writes a text file as a whole.
pub fn write_text(path: impl AsRef<Path>, text: &str) -> Result<()> {
    let mut writer = FileWriter::create(path)?;
    writer.write_all(text.as_bytes()).map_err(Error::io(&writer.target, "write"))?;
    writer.commit()
}
