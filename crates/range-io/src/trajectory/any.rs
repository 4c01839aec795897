use std::path::Path;

use super::fields::Line;
use super::{
    StampedPose, read_euroc, read_kitti, read_pose_folder, read_redwood_log, read_tum, write_euroc, write_kitti,
    write_tum,
};
use crate::read_text;
use crate::{Error, Result};

/// Form of a trajectory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum TrajectoryFormat {
    /// `timestamp tx ty tz qx qy qz qw`.
    Tum,
    /// Twelve numbers a line.
    Kitti,
    /// Nanoseconds and pose between commas.
    Euroc,
    /// Matrices below lines of three numbers; read only.
    RedwoodLog,
    /// A folder of matrices `frame-000000.pose.txt`; read only.
    PoseFolder,
}

impl TrajectoryFormat {
    /// The form by the first line that is no comment; a folder by its files.
    pub fn of_file(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        if path.is_dir() {
            return Ok(Self::PoseFolder);
        }
        let text = read_text(path)?;
        let Some(line) = Line::all(path, &text).next() else {
            return Err(Error::format(path, "has no pose"));
        };
        if line.text.contains(',') {
            return Ok(Self::Euroc);
        }
        match line.words().count() {
            8 => Ok(Self::Tum),
            12 => Ok(Self::Kitti),
            3 => Ok(Self::RedwoodLog),
            fields => Err(line.error(
                1,
                "",
                format!(
                    "has {fields} fields, expected a trajectory: 8 (TUM), 12 (KITTI), 3 above a matrix (Redwood) or \
                     fields between commas (EuRoC)"
                ),
            )),
        }
    }
}

/// Reads a trajectory of any form; for KITTI poses the times come from a file `times.txt` beside them, where there is one.
pub fn read_any_trajectory(path: impl AsRef<Path>) -> Result<Vec<StampedPose>> {
    let path = path.as_ref();
    match TrajectoryFormat::of_file(path)? {
        TrajectoryFormat::Tum => read_tum(path),
        TrajectoryFormat::Kitti => {
            let times = path.with_file_name("times.txt");
            read_kitti(path, times.is_file().then_some(times.as_path()))
        }
        TrajectoryFormat::Euroc => read_euroc(path),
        TrajectoryFormat::RedwoodLog => read_redwood_log(path),
        TrajectoryFormat::PoseFolder => read_pose_folder(path),
    }
}

/// Writes a trajectory as TUM, KITTI or `EuRoC`.
///
/// KITTI has no place for times: write them beside, one a line, where they matter.
pub fn write_any_trajectory(path: impl AsRef<Path>, poses: &[StampedPose], format: TrajectoryFormat) -> Result<()> {
    let path = path.as_ref();
    match format {
        TrajectoryFormat::Tum => write_tum(path, poses),
        TrajectoryFormat::Kitti => write_kitti(path, poses),
        TrajectoryFormat::Euroc => write_euroc(path, poses),
        TrajectoryFormat::RedwoodLog | TrajectoryFormat::PoseFolder => {
            Err(Error::format(path, "trajectories are written as TUM, KITTI or EuRoC only"))
        }
    }
}
