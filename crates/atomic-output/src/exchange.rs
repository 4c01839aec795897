//! A new folder of results in the place of an older one.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::{disk, leftovers};
use crate::{Error, Result};

/// Gives the folder `new` the name `target`, at which there may be an older folder; the path of that one afterwards.
///
/// Where the system can, both change names in one step. Where it can't, there is a moment in which the older folder
/// lies aside and the new one is not in place yet: a program that is cut off then leaves that to [`restore`]. On an error
/// the older folder is where it was.
pub(crate) fn put(new: &Path, target: &Path) -> Result<Option<PathBuf>> {
    let parent = leftovers::parent(target);
    let failed = |operation| Error::io(target, operation);
    if !target.exists() {
        disk::rename(new, target).map_err(failed("rename the finished folder to it"))?;
        return match disk::sync_folder(parent) {
            Ok(()) => Ok(None),
            Err(error) => {
                fs::rename(target, new).map_err(failed("take back the new folder"))?;
                Err(failed("bring the folder's name to the disk")(error))
            }
        };
    }
    match disk::exchange(new, target) {
        Ok(()) => match disk::sync_folder(parent) {
            Ok(()) => Ok(Some(new.to_owned())),
            Err(error) => {
                take_back(target, new, parent)?;
                Err(failed("bring the folder's name to the disk")(error))
            }
        },
        Err(error) if error.kind() == ErrorKind::Unsupported => in_two_steps(new, target).map(Some),
        Err(error) => Err(failed("let the finished folder change names with it")(error)),
    }
}

/// Takes an exchange back.
fn take_back(target: &Path, new: &Path, parent: &Path) -> Result<()> {
    disk::exchange(new, target).map_err(Error::io(target, "restore the older output"))?;
    // The error that led here is told; this one would say the same.
    let _ = disk::sync_folder(parent);
    Ok(())
}

fn in_two_steps(new: &Path, target: &Path) -> Result<PathBuf> {
    let aside = leftovers::aside_name(target)?;
    let failed = |operation| Error::io(target, operation);
    disk::rename(target, &aside).map_err(failed("move the older output aside"))?;
    let placed = disk::rename(new, target).and_then(|()| match disk::sync_folder(leftovers::parent(target)) {
        Ok(()) => Ok(()),
        Err(error) => fs::rename(target, new).and(Err(error)),
    });
    match placed {
        Ok(()) => Ok(aside),
        Err(error) => {
            fs::rename(&aside, target).map_err(failed("restore the older output"))?;
            Err(failed("rename the finished folder to it")(error))
        }
    }
}

/// Puts an older output back that a commit had moved aside when it was cut off.
pub(crate) fn restore(target: &Path) -> Result<()> {
    let aside = leftovers::aside_name(target)?;
    if !target.exists() && aside.is_dir() {
        disk::rename(&aside, target).map_err(Error::io(target, "restore the older output"))?;
    }
    Ok(())
}
