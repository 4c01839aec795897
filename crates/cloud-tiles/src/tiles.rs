//! From a PLY to an octree in one file.

use std::path::{Path, PathBuf};

use crate::copc::CopcWriter;
use crate::octree::{Key, Octree, See, Source};
use crate::ply::PlyFile;
use crate::record::{Extent, Layout};
use crate::{Error, Result};

/// Fewest points that may be in memory: of fewer, nodes would not be the same as with more.
pub const FEWEST_POINTS_IN_MEMORY: u64 = 500_000;

/// How much is done at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TileOptions {
    /// Points that are in memory at once, about; each takes twice its bytes in the file, some 110. It changes the time, not the result.
    /// Default four million.
    pub points_in_memory: u64,
}

/// What was written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tiles {
    /// Points.
    pub points: u64,
    /// Points without finite coordinates, which are left out.
    pub left_out: u64,
    /// Nodes of the octree.
    pub nodes: usize,
    /// What coordinates are rounded to, metre.
    pub step_m: f64,
}

impl Default for TileOptions {
    fn default() -> Self {
        Self { points_in_memory: 4_000_000 }
    }
}

/// Writes the points of a binary PLY as an octree that viewers read piece by piece (COPC 1.0, in a file `*.copc.laz`). Beside it a file
/// of parts (`*.parts`, as large as the points) is there while it works, where not all of them fit into memory.
///
/// All properties of the points go with them: `x y z` as coordinates, rounded to [`Tiles::step_m`], `intensity` as share of the largest one
/// and, as it is, as `amplitude`, `nx ny nz` as `NormalX` and so on, `frame` also as the source of a point, all others under their
/// names; points with `flags` are marked as withheld.
///
/// # Errors
/// [`Error::Format`] for a file that is no binary PLY of points alone; [`Error::NoPoints`]; [`Error::TooWide`]; [`Error::OutOfDomain`] for
/// less memory than [`FEWEST_POINTS_IN_MEMORY`]; [`Error::Io`].
pub fn write_tiles(ply: impl AsRef<Path>, tiles: impl AsRef<Path>, options: &TileOptions) -> Result<Tiles> {
    let (ply, tiles) = (ply.as_ref(), tiles.as_ref());
    if options.points_in_memory < FEWEST_POINTS_IN_MEMORY {
        return Err(Error::OutOfDomain {
            name: "points_in_memory",
            value: options.points_in_memory,
            expected: format!("at least {FEWEST_POINTS_IN_MEMORY}"),
        });
    }
    let file = PlyFile::open(ply)?;
    let layout = Layout::new(ply, &file, Extent::of(&file)?)?;
    let records = layout.extent.points;
    let each = |see: &mut See<'_>| {
        let mut record = Vec::with_capacity(layout.length);
        file.each(|point| {
            record.clear();
            if layout.put(point, &mut record) { see(&record) } else { Ok(()) }
        })
    };
    let mut writer = CopcWriter::create(tiles.to_owned(), &layout)?;
    let size = (layout.length, layout.bits);
    let mut octree = Octree::new(&mut writer, &beside(tiles), size, options.points_in_memory)?;
    octree.build(Key::default(), &Source::Stream { records, each: &each })?;
    drop(octree);
    let nodes = writer.commit()?;
    Ok(Tiles { points: records, left_out: file.points - records, nodes, step_m: layout.step_m })
}

/// The file of parts.
fn beside(tiles: &Path) -> PathBuf {
    let mut name = tiles.file_name().unwrap_or_default().to_owned();
    name.push(".parts");
    tiles.with_file_name(name)
}
