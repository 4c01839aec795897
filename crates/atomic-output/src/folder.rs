//! A folder of results.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use super::contents::{Contents, MARKER, remove, replaceable_files};
use super::destination::Destination;
use super::file::write_text;
use super::{disk, exchange, leftovers};
use crate::{Error, Result};

/// A folder of results that appears under its name at [`OutputFolder::commit`] and not before; made by
/// [`Destination::open`].
///
/// Files are written into [`OutputFolder::path`]. The commit puts a file [`OutputFolder::MARKER`] in that lists them. Only
/// folders that hold nothing but what such a list names, or are empty, are ever replaced, so that neither a slip in a path
/// nor a file that someone has put there is lost. Dropped without commit, it removes what it wrote, and an older output
/// stands untouched.
#[derive(Debug)]
pub struct OutputFolder {
    target: PathBuf,
    temporary: PathBuf,
    /// Folders that were made on the way to it, the outermost first.
    parents: Vec<PathBuf>,
    older: Vec<PathBuf>,
    /// Says to other runs that this one lives.
    lock: Option<File>,
    committed: bool,
}

impl OutputFolder {
    /// Name of the file that marks a folder as a complete output.
    pub const MARKER: &str = MARKER;

    /// Makes a temporary folder beside the place; missing parents are made too.
    pub(crate) fn create(destination: &Destination) -> Result<Self> {
        let target = destination.target().to_path_buf();
        let temporary = leftovers::temporary_name(&target)?;
        let older = destination.older_files().to_vec();
        // From here on the folder cleans up behind itself.
        let mut folder = Self { target, temporary, parents: Vec::new(), older, lock: None, committed: false };
        let missing = |path: &&Path| !path.exists();
        let missing: Vec<&Path> = leftovers::parent(&folder.target).ancestors().take_while(missing).collect();
        for parent in missing.into_iter().rev() {
            match disk::create_folder(parent) {
                Ok(()) => folder.parents.push(parent.to_path_buf()),
                // Another run was faster.
                Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(Error::io(parent, "create the folder")(error)),
            }
        }
        disk::create_folder(&folder.temporary)
            .map_err(Error::io(&folder.target, "create a temporary folder beside it"))?;
        folder.lock = leftovers::lock(&folder.temporary);
        Ok(folder)
    }

    /// The temporary folder to write into.
    pub fn path(&self) -> &Path {
        &self.temporary
    }

    /// The name the folder will have, with links resolved.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// A path in the temporary folder, with its parent folders made.
    pub fn file(&self, relative: impl AsRef<Path>) -> Result<PathBuf> {
        let relative = relative.as_ref();
        let folders: Vec<&Path> = relative.ancestors().skip(1).filter(|path| !path.as_os_str().is_empty()).collect();
        for folder in folders.into_iter().rev().map(|folder| self.temporary.join(folder)) {
            if !folder.is_dir() {
                disk::create_folder(&folder).map_err(Error::io(&folder, "create the folder"))?;
            }
        }
        Ok(self.temporary.join(relative))
    }

    /// Removes a file that was written to be read back and is no result, and its folder where that is left empty.
    pub fn discard(&self, relative: impl AsRef<Path>) -> Result<()> {
        let path = self.temporary.join(relative);
        fs::remove_file(&path).map_err(Error::io(&path, "remove"))?;
        if let Some(folder) = path.parent().filter(|folder| *folder != self.temporary) {
            // One that holds something stays.
            let _ = fs::remove_dir(folder);
        }
        Ok(())
    }

    /// Puts the files of the older output in, as they stand: what is written beside them is added to it.
    pub fn keep_older(&self) -> Result<()> {
        for file in &self.older {
            let from = self.target.join(file);
            disk::link_or_copy(&from, &self.file(file)?).map_err(Error::io(&from, "keep"))?;
        }
        Ok(())
    }

    /// Brings everything to the disk and gives the folder its name, in place of an older output.
    pub fn commit(mut self) -> Result<()> {
        let contents = Contents::of(&self.temporary).map_err(Error::io(&self.temporary, "list the folder"))?;
        let marker = contents.marker().map_err(|file| {
            Error::format(&self.target.join(file), "is no name for a file of an output: it is no text in one line")
        })?;
        write_text(self.temporary.join(MARKER), &marker)?;
        self.sync(&contents)?;
        if self.target.exists() {
            // Someone may have put a file there in the meantime.
            replaceable_files(&self.target)?;
        }
        let older = exchange::put(&self.temporary, &self.target)?;
        self.committed = true;
        if let Some(older) = older {
            // The new output stands. What can't be removed of the older one is left to the next run.
            let _ = remove(&older);
        }
        Ok(())
    }

    fn sync(&self, contents: &Contents) -> Result<()> {
        let inside = contents.files.iter().chain(&contents.folders).map(|path| self.temporary.join(path));
        let own = [self.temporary.join(MARKER), self.temporary.clone()];
        let parents = self.parents.iter().map(|folder| leftovers::parent(folder).to_path_buf());
        let paths: Vec<PathBuf> = inside.chain(own).chain(parents).collect();
        disk::sync(&paths).map_err(|(path, error)| Error::io(&path, "bring to the disk")(error))
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        drop(self.lock.take());
        if self.committed {
            return;
        }
        // Nothing can be done about an error here but leave the temporary folder to the next run.
        let _ = fs::remove_dir_all(&self.temporary);
        for parent in self.parents.iter().rev() {
            // One that another run writes into stays.
            let _ = fs::remove_dir(parent);
        }
    }
}
