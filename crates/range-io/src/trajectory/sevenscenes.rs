use std::path::{Path, PathBuf};

use super::StampedPose;
use super::fields::{Line, matrix_of_lines};
use crate::read_text;
use crate::{Error, Result};

/// Reads a folder of the 7-Scenes kind: files `frame-000000.pose.txt` with a 4x4 camera-to-world matrix each.
///
/// The number in the name stands for the time.
pub fn read_pose_folder(path: impl AsRef<Path>) -> Result<Vec<StampedPose>> {
    let path = path.as_ref();
    let mut files = pose_files(path)?;
    if files.is_empty() {
        return Err(Error::format(path, "has no poses, expected files such as frame-000000.pose.txt"));
    }
    files.sort();
    files.iter().map(|(frame, file)| pose(*frame, file)).collect()
}

/// Number and path of each file of a pose.
pub(super) fn pose_files(folder: &Path) -> Result<Vec<(u64, PathBuf)>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(Error::io(folder, "list the folder"))? {
        let file = entry.map_err(Error::io(folder, "list the folder"))?.path();
        let name = file.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let Some(stem) = name.strip_suffix(".pose.txt") else { continue };
        let digits = stem.trim_start_matches(|c: char| !c.is_ascii_digit());
        let frame = digits.parse().map_err(|_| Error::format(&file, "has no frame's number in its name"))?;
        files.push((frame, file));
    }
    Ok(files)
}

fn pose(frame: u64, path: &Path) -> Result<StampedPose> {
    let text = read_text(path)?;
    let mut lines = Line::all(path, &text);
    let above = Line { file: path, number: 1, text: "" };
    let world_from_camera = matrix_of_lines(&mut lines, above)?;
    match lines.next() {
        Some(line) => Err(line.error(1, "", "is one line too many, expected 4 of a matrix")),
        None => Ok(StampedPose { timestamp_s: frame as f64, world_from_camera }),
    }
}
