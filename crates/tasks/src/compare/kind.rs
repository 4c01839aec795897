//! What a path holds, and which parts of two results belong together.

use std::path::{Path, PathBuf};

use pipeline::{Error, Result};
use range_io::clouds::CloudFormat;
use range_io::trajectory::TrajectoryFormat;

/// Two files that can be compared.
pub(crate) enum Part {
    Clouds(PathBuf, PathBuf),
    Stations(PathBuf, PathBuf),
    Trajectories(PathBuf, PathBuf),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Cloud,
    Stations,
    Trajectory,
    Output,
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::Cloud => "a point cloud",
            Self::Stations => "a table of stations",
            Self::Trajectory => "a trajectory",
            Self::Output => "an output folder",
        }
    }
}

const CLOUDS: [&str; 3] = ["cloud.ply", "cloud.pcd", "cloud.e57"];
const STATIONS: &str = "stations.csv";
const TRAJECTORY: &str = "trajectory.txt";

/// The parts that both have.
pub(crate) fn parts(first: &Path, second: &Path) -> Result<Vec<Part>> {
    let kinds = [kind(first)?, kind(second)?];
    let (a, b) = (first.to_owned(), second.to_owned());
    match kinds {
        [Kind::Cloud, Kind::Cloud] => Ok(vec![Part::Clouds(a, b)]),
        [Kind::Stations, Kind::Stations] => Ok(vec![Part::Stations(a, b)]),
        [Kind::Trajectory, Kind::Trajectory] => Ok(vec![Part::Trajectories(a, b)]),
        [Kind::Output, Kind::Output] => common_parts(first, second),
        // A result against a truth: a folder has a part of the kind of the file.
        [Kind::Output, other] => {
            let a = common_part(first, other).ok_or_else(|| mismatch(first, second, kinds))?;
            Ok(vec![part(other, a, b)])
        }
        [other, Kind::Output] => {
            let b = common_part(second, other).ok_or_else(|| mismatch(first, second, kinds))?;
            Ok(vec![part(other, a, b)])
        }
        _ => Err(mismatch(first, second, kinds)),
    }
}

fn part(kind: Kind, a: PathBuf, b: PathBuf) -> Part {
    match kind {
        Kind::Cloud => Part::Clouds(a, b),
        Kind::Stations => Part::Stations(a, b),
        _ => Part::Trajectories(a, b),
    }
}

fn mismatch(first: &Path, second: &Path, kinds: [Kind; 2]) -> Error {
    let [a, b] = kinds.map(Kind::name);
    let (first, second) = (first.display(), second.display());
    Error::Compare(format!("{first} is {a} and {second} is {b}, expected two of one kind"))
}

/// The file in an output folder that is of a kind.
fn common_part(folder: &Path, kind: Kind) -> Option<PathBuf> {
    let names: &[&str] = match kind {
        Kind::Cloud => &CLOUDS,
        Kind::Stations => &[STATIONS],
        _ => &[TRAJECTORY],
    };
    names.iter().map(|name| folder.join(name)).find(|path| path.is_file())
}

fn common_parts(first: &Path, second: &Path) -> Result<Vec<Part>> {
    let both = |kind: Kind| Some((common_part(first, kind)?, common_part(second, kind)?));
    let mut parts = Vec::new();
    parts.extend(both(Kind::Cloud).map(|(a, b)| Part::Clouds(a, b)));
    parts.extend(both(Kind::Stations).map(|(a, b)| Part::Stations(a, b)));
    // The poses of a run stand in both; stations are matched by name, which is surer than time.
    if parts.iter().all(|part| !matches!(part, Part::Stations(..))) {
        parts.extend(both(Kind::Trajectory).map(|(a, b)| Part::Trajectories(a, b)));
    }
    if parts.is_empty() {
        let (first, second) = (first.display(), second.display());
        return Err(Error::Compare(format!("{first} and {second} have no file in common that can be compared")));
    }
    Ok(parts)
}

fn kind(path: &Path) -> Result<Kind> {
    if path.is_dir() {
        let is_output =
            [Kind::Cloud, Kind::Stations, Kind::Trajectory].iter().any(|kind| common_part(path, *kind).is_some());
        if is_output {
            return Ok(Kind::Output);
        }
        let has_poses = std::fs::read_dir(path)
            .map_err(|source| Error::Access { path: path.to_owned(), source })?
            .flatten()
            .any(|entry| entry.file_name().to_string_lossy().ends_with(".pose.txt"));
        return if has_poses { Ok(Kind::Trajectory) } else { Err(unknown(path)) };
    }
    let format = match CloudFormat::of_file(path) {
        Err(error @ range_io::Error::Io { .. }) => return Err(error.into()),
        other => other.ok(),
    };
    let first = first_line(path)?;
    let fields = || first.split([',', ';', ' ', '\t']).map(str::trim).filter(|field| !field.is_empty());
    if fields().any(|field| field == "station") {
        return Ok(Kind::Stations);
    }
    // Eight numbers (TUM, EuRoC), twelve (KITTI) or seventeen without names are poses: a list of points would name them.
    let numbers = fields().all(|field| field.parse::<f64>().is_ok());
    let poses = numbers && matches!(fields().count(), 8 | 12 | 17);
    match format {
        Some(CloudFormat::Xyz) if poses => Ok(Kind::Trajectory),
        Some(_) => Ok(Kind::Cloud),
        None if TrajectoryFormat::of_file(path).is_ok() => Ok(Kind::Trajectory),
        None => Err(unknown(path)),
    }
}

fn unknown(path: &Path) -> Error {
    Error::Compare(format!(
        "{} is nothing that can be compared, expected a point cloud (PLY, PCD, E57, VTK, xyz), a trajectory (TUM, KITTI, \
         EuRoC, Redwood log, folder of .pose.txt), stations.csv, or an output folder with cloud, stations or trajectory",
        path.display()
    ))
}

/// The first line that is neither empty nor a comment, of the first kilobytes.
fn first_line(path: &Path) -> Result<String> {
    use std::io::Read;
    let failed = |source| Error::Access { path: path.to_owned(), source };
    let mut bytes = Vec::new();
    range_io::open(path)?.0.take(4096).read_to_end(&mut bytes).map_err(failed)?;
    let text = String::from_utf8_lossy(&bytes).into_owned();
    let mut lines = text.lines().map(|line| line.trim_start_matches('\u{feff}').trim());
    Ok(lines.find(|line| !line.is_empty() && !line.starts_with('#')).unwrap_or_default().to_owned())
}
