//! Point clouds of any format, by content and ending.

use std::io::Read;
use std::path::Path;

use crate::formats::cloud_file::{CloudFile, Precision};
use crate::formats::e57::{E57Scan, read_e57, write_e57};
use crate::formats::pcd::{read_pcd, write_pcd};
use crate::formats::ply::{read_cloud, write_cloud};
use crate::formats::vtk::read_vtk;
use crate::formats::xyz::{looks_like_points, read_xyz};
use crate::{Error, Result};

/// Format of a cloud's file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum CloudFormat {
    /// PLY in any encoding.
    Ply,
    /// PCD 0.7 in any encoding.
    Pcd,
    /// E57.
    E57,
    /// Legacy VTK.
    Vtk,
    /// Points as text, one a line.
    Xyz,
}

/// Bytes that tell a format, or at least a line of numbers.
const BEGINNING: u64 = 1024;

impl CloudFormat {
    /// The format by a file's first bytes; where those are text of no known kind, points as text if the ending is one of
    /// `.xyz`, `.xyzn`, `.xyzi`, `.txt`, `.asc`, `.csv` and a first line fits.
    pub fn of_file(path: impl AsRef<Path>) -> Result<Self> {
        const TEXT: [&str; 6] = ["xyz", "xyzn", "xyzi", "txt", "asc", "csv"];
        let path = path.as_ref();
        if path.is_dir() {
            return Err(Error::format(path, "is a folder, expected the file of a point cloud"));
        }
        let (file, _) = crate::open(path)?;
        let mut bytes = Vec::new();
        file.take(BEGINNING).read_to_end(&mut bytes).map_err(Error::io(path, "read"))?;
        let starts = |begin: &str| bytes.starts_with(begin.as_bytes());
        if starts("ply\n") || starts("ply\r") {
            return Ok(Self::Ply);
        }
        if starts("ASTM-E57") {
            return Ok(Self::E57);
        }
        if starts("# vtk DataFile") {
            return Ok(Self::Vtk);
        }
        if starts("# .PCD") || starts("# .pcd") || starts("VERSION") {
            return Ok(Self::Pcd);
        }
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
        let text = String::from_utf8_lossy(&bytes);
        let is_points = |line: &&str| looks_like_points(line.trim_start_matches('\u{feff}'));
        if TEXT.contains(&ending.as_str()) && text.lines().any(|line| is_points(&line)) {
            return Ok(Self::Xyz);
        }
        Err(Error::format(
            path,
            "is no point cloud that is known here, expected PLY, PCD 0.7, E57, legacy VTK or a text of points \
             (.xyz, .txt, .asc, .csv)",
        ))
    }

    /// The format that a file to write has by its ending.
    pub fn of_ending(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        match path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).as_deref() {
            Some("ply") => Ok(Self::Ply),
            Some("pcd") => Ok(Self::Pcd),
            Some("e57") => Ok(Self::E57),
            _ => Err(Error::format(path, "has no ending that a cloud is written with, expected .ply, .pcd or .e57")),
        }
    }
}

/// Reads a cloud of any format.
///
/// Points stay in the frame in which the file has them, with the pose beside them. An E57 file of several scans becomes
/// one cloud in the file's common frame, with the scan's index as `frame`.
pub fn read_any_cloud(path: impl AsRef<Path>) -> Result<CloudFile> {
    let path = path.as_ref();
    match CloudFormat::of_file(path)? {
        CloudFormat::Ply => read_cloud(path),
        CloudFormat::Pcd => read_pcd(path),
        CloudFormat::Vtk => read_vtk(path),
        CloudFormat::Xyz => read_xyz(path),
        CloudFormat::E57 => one_cloud(path),
    }
}

/// Writes a cloud in the format of the ending: `.ply`, `.pcd` or `.e57`.
pub fn write_any_cloud(path: impl AsRef<Path>, cloud: &CloudFile, precision: Precision) -> Result<()> {
    let path = path.as_ref();
    match CloudFormat::of_ending(path)? {
        CloudFormat::Pcd => write_pcd(path, cloud, precision),
        CloudFormat::E57 => write_e57(path, &[E57Scan { name: String::new(), cloud: cloud.clone() }], precision),
        _ => write_cloud(path, cloud, precision),
    }
}

fn one_cloud(path: &Path) -> Result<CloudFile> {
    let mut scans = read_e57(path)?;
    if scans.len() == 1 {
        return Ok(scans.remove(0).cloud);
    }
    let mut all: Option<CloudFile> = None;
    for (index, scan) in scans.into_iter().enumerate() {
        let count = scan.cloud.len();
        let mut cloud = scan.cloud.in_world();
        (cloud.frame, cloud.size) = (Some(vec![index as u32; count]), None);
        all = Some(match all {
            None => cloud,
            Some(before) => joined(before, cloud),
        });
    }
    all.ok_or_else(|| Error::format(path, "has no scan"))
}

/// Both clouds one behind the other, with the attributes that both have.
fn joined(mut first: CloudFile, second: CloudFile) -> CloudFile {
    fn join<T>(first: &mut Option<Vec<T>>, second: Option<Vec<T>>) {
        match (first.as_mut(), second) {
            (Some(first), Some(second)) => first.extend(second),
            _ => *first = None,
        }
    }
    first.points.extend(second.points);
    join(&mut first.normals, second.normals);
    join(&mut first.intensity, second.intensity);
    join(&mut first.sigma, second.sigma);
    join(&mut first.flags, second.flags);
    join(&mut first.frame, second.frame);
    join(&mut first.covariance, second.covariance);
    first
}
