//! Names of what is not finished, and what runs that were killed have left of them.

use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use super::contents::{self, MARKER};
use crate::{Error, Result};

/// In the name of what is not finished; the process and a number follow.
const PARTIAL: &str = ".partial-";

/// So long after its last change an output counts as left behind on file systems that can't lock one.
const LEFT_AFTER: Duration = Duration::from_secs(24 * 3600);

/// Between making an output and locking it a run takes no longer.
const LOCKED_AFTER: Duration = Duration::from_secs(60);

/// A name in the same folder that no other writer uses at the same time.
pub(crate) fn temporary_name(target: &Path) -> Result<PathBuf> {
    static COUNTER: AtomicU64 = AtomicU64::new(0);
    let count = COUNTER.fetch_add(1, Ordering::Relaxed);
    let process = std::process::id();
    Ok(target.with_file_name(format!(".{}{PARTIAL}{process}-{count}", file_name(target)?)))
}

/// Where an older output lies while a new one takes its place on systems that can't exchange the two.
pub(crate) fn aside_name(target: &Path) -> Result<PathBuf> {
    Ok(target.with_file_name(format!(".{}.replaced", file_name(target)?)))
}

/// Whether a path leads into a folder that is still being written.
pub(crate) fn is_in_unfinished_folder(path: &Path) -> bool {
    let is_unfinished = |name: &str| name.starts_with('.') && name.contains(PARTIAL);
    path.ancestors().skip(1).any(|path| path.file_name().and_then(|name| name.to_str()).is_some_and(is_unfinished))
}

/// The folder in which a path's last name stands.
pub(crate) fn parent(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

fn file_name(target: &Path) -> Result<String> {
    let name = target.file_name().ok_or_else(|| Error::format(target, "has no name of its own to write to"))?;
    Ok(name.to_string_lossy().into_owned())
}

/// Locks a folder that is being written, for as long as what is returned is open; `None` where the system can't.
pub(crate) fn lock(folder: &Path) -> Option<File> {
    let file = File::open(folder).ok()?;
    file.try_lock().ok()?;
    Some(file)
}

/// Removes what killed runs for this name have left beside it. What can't be removed is left to the next run.
pub(crate) fn remove_of(target: &Path) -> Result<()> {
    let start = format!(".{}{PARTIAL}", file_name(target)?);
    let aside = aside_name(target)?;
    let Ok(entries) = fs::read_dir(parent(target)) else { return Ok(()) };
    for path in entries.flatten().map(|entry| entry.path()) {
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        let process = name.strip_prefix(&start).and_then(process_of);
        // A pipe would be waited for.
        if path.is_symlink() || !(path.is_dir() || path.is_file()) {
            continue;
        }
        let is_left = || process.is_some_and(|process| is_left(&path, process));
        if path == aside && path.is_dir() {
            // With a new output in its place; without, it was put back before.
            let _ = contents::remove(&path);
        } else if is_left() {
            // A complete one is an older output that was to be removed: no more than it lists.
            if path.join(MARKER).exists() {
                let _ = contents::remove(&path);
            } else if path.is_dir() {
                let _ = fs::remove_dir_all(&path);
            } else {
                let _ = fs::remove_file(&path);
            }
        }
    }
    Ok(())
}

/// The process in the end of a temporary name.
fn process_of(ending: &str) -> Option<u32> {
    let (process, count) = ending.split_once('-')?;
    count.parse::<u64>().ok()?;
    process.parse().ok()
}

/// Whether no run writes into the folder or file any more.
fn is_left(path: &Path, process: u32) -> bool {
    let changed = fs::metadata(path).and_then(|data| data.modified()).ok();
    let age = changed.and_then(|time| time.elapsed().ok()).unwrap_or_default();
    match File::open(path).map(|file| file.try_lock()) {
        Ok(Err(TryLockError::WouldBlock)) => false,
        Ok(Ok(())) => age > LOCKED_AFTER || is_gone(process),
        Ok(Err(TryLockError::Error(_))) | Err(_) => age > LEFT_AFTER,
    }
}

/// Whether there is surely no process of this number, or one that has ended and that nobody has asked for its code yet.
fn is_gone(process: u32) -> bool {
    let state = |process: &str| fs::read_to_string(Path::new("/proc").join(process).join("stat"));
    // The state stands behind the program's name, which is in parentheses and may have some itself.
    let has_ended =
        |text: String| text.rsplit(')').next().is_some_and(|rest| rest.trim_start().starts_with(['Z', 'X']));
    state("self").is_ok() && state(&process.to_string()).map_or(true, has_ended)
}
