//! Where results are to be written, checked against what they are made from.

use std::collections::VecDeque;
use std::ffi::OsString;
use std::io;
use std::path::{Component, Path, PathBuf};

use super::contents::replaceable_files;
use super::folder::OutputFolder;
use super::{exchange, leftovers};
use crate::{Error, Result};

/// The place of an output that was found to be free, or taken by an earlier output that may be replaced, and to hold
/// nothing that is read.
///
/// Made before any work is done, it makes sure that the work is not for nothing and costs nobody anything.
#[derive(Debug, Clone)]
pub struct Destination {
    named: PathBuf,
    target: PathBuf,
    older: Vec<PathBuf>,
}

impl Destination {
    /// Checks that results made from `inputs`, files and folders, may be written to the folder `out`.
    ///
    /// Links are followed, that of `out` itself too: the folder that it leads to is written, and the link stays. Neither
    /// `out` nor an input need exist.
    ///
    /// # Errors
    /// [`Error::OverInput`] where `out` is, contains or lies in an input; [`Error::Format`] where there is something that
    /// is no earlier output, or holds files that the output did not write.
    pub fn new<P: AsRef<Path>>(out: impl AsRef<Path>, inputs: &[P]) -> Result<Self> {
        let named = out.as_ref().to_path_buf();
        if !matches!(named.components().next_back(), Some(Component::Normal(_))) {
            return Err(Error::format(&named, "has no name of its own to write to"));
        }
        let target = resolve(&named)?;
        for input in inputs {
            let input = input.as_ref();
            let real = resolve(input)?;
            if let Some(relation) = relation(&target, &real) {
                return Err(Error::OverInput { out: named, relation, input: input.to_path_buf() });
            }
        }
        exchange::restore(&target)?;
        let older = if target.is_dir() {
            replaceable_files(&target)?
        } else if target.exists() {
            return Err(Error::format(&named, "is a file, expected the name of an output folder"));
        } else {
            Vec::new()
        };
        Ok(Self { named, target, older })
    }

    /// The folder as it was named.
    pub fn named(&self) -> &Path {
        &self.named
    }

    /// The folder with links resolved.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Files of the earlier output that is there, relative to the folder.
    pub fn older_files(&self) -> &[PathBuf] {
        &self.older
    }

    /// Begins to write: what killed runs left here is removed, and a temporary folder is made beside the place.
    pub fn open(&self) -> Result<OutputFolder> {
        leftovers::remove_of(&self.target)?;
        OutputFolder::create(self)
    }
}

/// How the output's place and an input meet.
fn relation(out: &Path, input: &Path) -> Option<&'static str> {
    let is_in = |inner: &Path, outer: &Path| inner.ancestors().skip(1).any(|path| is_same(path, outer));
    if is_same(out, input) {
        Some("is")
    } else if is_in(input, out) {
        Some("contains")
    } else if is_in(out, input) {
        Some("lies in")
    } else {
        None
    }
}

fn is_same(one: &Path, other: &Path) -> bool {
    one == other || identity(one).is_some_and(|known| identity(other) == Some(known))
}

/// What tells that two paths lead to one thing by other ways than links, such as mounts and names without case.
#[cfg(unix)]
fn identity(path: &Path) -> Option<[u64; 2]> {
    use std::os::unix::fs::MetadataExt;
    std::fs::metadata(path).ok().map(|data| [data.dev(), data.ino()])
}

#[cfg(not(unix))]
fn identity(_: &Path) -> Option<[u64; 2]> {
    None
}

/// More links than this lead in a circle.
const MOST_LINKS: usize = 40;

/// The absolute path without links; parts that do not exist are taken as they stand.
fn resolve(path: &Path) -> Result<PathBuf> {
    // Whatever the system says against a path, another one has to be named.
    followed(path).map_err(|error| Error::format(path, format!("leads nowhere: {error}")))
}

fn followed(path: &Path) -> io::Result<PathBuf> {
    let absolute = std::path::absolute(if path.as_os_str().is_empty() { Path::new(".") } else { path })?;
    let mut pending = parts(&absolute);
    let mut resolved = PathBuf::new();
    let mut links = 0;
    while let Some(part) = pending.pop_front() {
        if part == ".." {
            resolved.pop();
            continue;
        }
        let next = resolved.join(&part);
        match std::fs::canonicalize(&next) {
            Ok(real) => resolved = real,
            Err(error) if error.kind() == io::ErrorKind::NotFound => match std::fs::read_link(&next) {
                // A link to what does not exist yet.
                Ok(destination) => {
                    links += 1;
                    if links > MOST_LINKS {
                        return Err(error);
                    }
                    for part in parts(&destination).into_iter().rev() {
                        pending.push_front(part);
                    }
                }
                Err(_) => resolved = next,
            },
            Err(error) => return Err(error),
        }
    }
    Ok(resolved)
}

/// The names of a path, from the root on; joined, an absolute one starts anew.
fn parts(path: &Path) -> VecDeque<OsString> {
    let parts = path.components().filter(|part| *part != Component::CurDir);
    parts.map(|part| part.as_os_str().to_owned()).collect()
}
