//! Clouds of very many points: in tiles instead of one PLY, and points that are written last.

use std::cell::Cell;

use atomic_output::OutputFolder;
use cloud_tiles::{FEWEST_POINTS_IN_MEMORY, TileOptions, write_tiles};
use range_io::clouds::{CloudFile, Precision};
use range_io::ply::{PlyWriter, read_cloud};
use serde::Serialize;

use crate::memory::Memory;
use crate::{Error, Result};

/// Points above which a cloud is written in tiles where nobody says otherwise: 3 GB as PLY, and more than viewers and `measure` take.
pub const TILES_ABOVE: u64 = 100_000_000;

/// Bytes of a point while tiles are written: its record twice, and what is not told here.
const BYTES_A_POINT: u64 = 160;

thread_local! {
    static ABOVE: Cell<u64> = const { Cell::new(TILES_ABOVE) };
}

/// A cloud in tiles.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TiledCloud {
    /// The file, relative to the output folder.
    pub file: String,
    /// Points.
    pub points: u64,
    /// Tiles: nodes of the octree.
    pub nodes: usize,
    /// What coordinates are rounded to, metre.
    pub step_m: f64,
}

/// Does work whose clouds of more points than this are written in tiles; `None`: [`TILES_ABOVE`].
pub fn above<T>(points: Option<u64>, work: impl FnOnce() -> T) -> T {
    let before = ABOVE.replace(points.unwrap_or(TILES_ABOVE));
    let done = work();
    ABOVE.set(before);
    done
}

/// Puts tiles (`NAME.copc.laz`) in the place of `NAME.ply` of a folder that is being written, where that has so many points.
///
/// # Errors
/// [`Error::Tiles`] where the cloud can't be written so; [`Error::Memory`] where less is allowed than that takes.
pub fn of_cloud(folder: &OutputFolder, name: &str, points: u64) -> Result<Option<TiledCloud>> {
    if points <= ABOVE.get() || points == 0 {
        return Ok(None);
    }
    let (ply, file) = (format!("{name}.ply"), format!("{name}.copc.laz"));
    let points_in_memory = Memory::present().most_points(points)?;
    let tiles = write_tiles(folder.file(&ply)?, folder.file(&file)?, &TileOptions { points_in_memory });
    let tiles = tiles.map_err(Error::from)?;
    folder.discard(&ply)?;
    Ok(Some(TiledCloud { file, points: tiles.points, nodes: tiles.nodes, step_m: tiles.step_m }))
}

/// The name of the file that has a cloud.
pub fn cloud_file<'a>(tiles: Option<&'a TiledCloud>, otherwise: &'a str) -> &'a str {
    tiles.map_or(otherwise, |tiles| &tiles.file)
}

impl Memory {
    /// Points that may be in memory while tiles are written.
    fn most_points(self, points: u64) -> Result<u64> {
        let work = crate::memory::Work {
            what: "writing a cloud in tiles",
            // Marks of the cells of nodes, blocks of the file of parts.
            kept: FEWEST_POINTS_IN_MEMORY * BYTES_A_POINT + 150_000_000,
            each: BYTES_A_POINT,
            most: usize::try_from(points.min(TileOptions::default().points_in_memory)).unwrap_or(usize::MAX),
        };
        Ok(FEWEST_POINTS_IN_MEMORY + self.at_once(&work)? as u64)
    }
}

/// Points that are written last into a cloud, in files of their own until then: of a long survey they are too many to be kept.
pub struct LastPoints<'a> {
    folder: &'a OutputFolder,
    /// Files so far, and what the last one has, where it is open.
    files: usize,
    open: Option<(PlyWriter, usize)>,
    points: usize,
}

/// Points of a file of these, about: 30 MB, which are read at once.
const LAST_AT_ONCE: usize = 1_000_000;

impl<'a> LastPoints<'a> {
    /// None, in a folder that is being written.
    pub fn new(folder: &'a OutputFolder) -> Self {
        Self { folder, files: 0, open: None, points: 0 }
    }

    /// How many they are.
    pub fn points(&self) -> usize {
        self.points
    }

    /// Adds some.
    pub fn add(&mut self, cloud: &CloudFile) -> Result<()> {
        if cloud.points.is_empty() {
            return Ok(());
        }
        let (mut writer, points) = if let Some(open) = self.open.take() {
            open
        } else {
            self.files += 1;
            (PlyWriter::create(self.folder.file(file(self.files - 1))?, Precision::Single)?, 0)
        };
        writer.append(cloud)?;
        self.points += cloud.points.len();
        self.open = Some((writer, points + cloud.points.len()));
        if points + cloud.points.len() > LAST_AT_ONCE { self.close().map(drop) } else { Ok(()) }
    }

    /// Completes the last file; how many there are.
    pub fn close(&mut self) -> Result<usize> {
        if let Some((writer, _)) = self.open.take() {
            writer.commit()?;
        }
        Ok(self.files)
    }

    /// Takes back what the file of this number has.
    pub fn take(&self, number: usize) -> Result<CloudFile> {
        let cloud = read_cloud(self.folder.file(file(number))?)?;
        self.folder.discard(file(number))?;
        Ok(cloud)
    }
}

fn file(number: usize) -> String {
    format!("last_points_{number}.ply")
}
