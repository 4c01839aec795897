//! Every change that an output makes to the disk, in one place, so that tests can make each of them fail.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// A change, which a test may make fail.
fn change<T>(operation: impl FnOnce() -> io::Result<T>) -> io::Result<T> {
    #[cfg(feature = "fault-injection")]
    fault::count()?;
    operation()
}

/// Makes one folder.
pub(crate) fn create_folder(path: &Path) -> io::Result<()> {
    change(|| fs::create_dir(path))
}

/// Opens a new file for reading and writing.
pub(crate) fn create_file(path: &Path) -> io::Result<File> {
    change(|| File::options().read(true).write(true).create_new(true).open(path))
}

/// Writes what fits.
pub(crate) fn write(file: &mut File, bytes: &[u8]) -> io::Result<usize> {
    change(|| file.write(bytes))
}

/// Brings a file's bytes to the disk.
pub(crate) fn sync_file(file: &File) -> io::Result<()> {
    change(|| file.sync_all())
}

/// Brings the names in a folder to the disk, where the system can.
pub(crate) fn sync_folder(path: &Path) -> io::Result<()> {
    change(|| sync_at(path))
}

/// So many files are brought to the disk at once. Each waits for the disk's journal, and what waits at once is written
/// at once: 500 files take a tenth of a second instead of two, with 8 as with 32.
const SYNCED_AT_ONCE: usize = 8;

/// Brings files and folders to the disk; with the error comes its path.
pub(crate) fn sync(paths: &[PathBuf]) -> Result<(), (PathBuf, io::Error)> {
    for path in paths {
        change(|| Ok(())).map_err(|error| (path.clone(), error))?;
    }
    let all =
        |paths: &[PathBuf]| paths.iter().try_for_each(|path| sync_at(path).map_err(|error| (path.clone(), error)));
    std::thread::scope(|scope| {
        let chunks = paths.chunks(paths.len().div_ceil(SYNCED_AT_ONCE).max(1));
        let begun: Vec<_> =
            chunks.map(|chunk| (chunk, std::thread::Builder::new().spawn_scoped(scope, move || all(chunk)))).collect();
        begun.into_iter().try_for_each(|(chunk, thread)| match thread.map(std::thread::ScopedJoinHandle::join) {
            Ok(Ok(done)) => done,
            // No thread was to be had.
            Ok(Err(_)) | Err(_) => all(chunk),
        })
    })
}

fn sync_at(path: &Path) -> io::Result<()> {
    if path.is_dir() && !cfg!(unix) {
        return Ok(());
    }
    // Windows asks for the right to write; elsewhere a file that may only be read does as well.
    match File::options().read(true).write(cfg!(windows)).open(path)?.sync_all() {
        // File systems that keep names safe by other means say so.
        Err(error) if matches!(error.kind(), io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported) => Ok(()),
        done => done,
    }
}

/// Gives a file or folder another name.
pub(crate) fn rename(from: &Path, to: &Path) -> io::Result<()> {
    change(|| fs::rename(from, to))
}

/// A second name for a file, or a copy of it where the file system has no second names.
pub(crate) fn link_or_copy(from: &Path, to: &Path) -> io::Result<()> {
    change(|| fs::hard_link(from, to).or_else(|_| fs::copy(from, to).map(drop)))
}

/// Lets two folders change names in one step; the error's kind is `Unsupported` where the system can't.
pub(crate) fn exchange(one: &Path, other: &Path) -> io::Result<()> {
    #[cfg(feature = "fault-injection")]
    if fault::is_without_exchange() {
        return Err(io::ErrorKind::Unsupported.into());
    }
    change(|| exchanged(one, other))
}

#[cfg(any(target_os = "linux", target_os = "android", target_vendor = "apple"))]
fn exchanged(one: &Path, other: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    use rustix::io::Errno;
    renameat_with(CWD, one, CWD, other, RenameFlags::EXCHANGE).map_err(|error| {
        // Of kernels without the call, and of file systems without the flag.
        let unsupported = [Errno::NOSYS, Errno::INVAL, Errno::NOTSUP, Errno::OPNOTSUPP];
        if unsupported.contains(&error) { io::ErrorKind::Unsupported.into() } else { error.into() }
    })
}

#[cfg(not(any(target_os = "linux", target_os = "android", target_vendor = "apple")))]
fn exchanged(_: &Path, _: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// Changes of the disk that fail, for tests. It counts on each thread by itself, so that tests run side by side.
#[cfg(feature = "fault-injection")]
pub mod fault {
    use std::cell::Cell;
    use std::io;

    thread_local! {
        static COUNT: Cell<usize> = const { Cell::new(0) };
        static FAILING: Cell<Option<usize>> = const { Cell::new(None) };
        static WITHOUT_EXCHANGE: Cell<bool> = const { Cell::new(false) };
    }

    /// Runs `work`, in which change `failing` of the disk (from 0) fails as on a full one; the number of changes that
    /// were tried.
    pub fn at<T>(failing: Option<usize>, work: impl FnOnce() -> T) -> (T, usize) {
        COUNT.set(0);
        FAILING.set(failing);
        let result = work();
        FAILING.set(None);
        (result, COUNT.get())
    }

    /// Runs `work` as on a system that can't let two folders change names in one step.
    pub fn without_exchange<T>(work: impl FnOnce() -> T) -> T {
        WITHOUT_EXCHANGE.set(true);
        let result = work();
        WITHOUT_EXCHANGE.set(false);
        result
    }

    pub(crate) fn is_without_exchange() -> bool {
        WITHOUT_EXCHANGE.get()
    }

    pub(crate) fn count() -> io::Result<()> {
        let number = COUNT.replace(COUNT.get() + 1);
        if FAILING.get() == Some(number) { Err(io::ErrorKind::StorageFull.into()) } else { Ok(()) }
    }
}
