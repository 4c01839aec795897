//! `rig.ron`: the cameras of a rig and their folders.

use std::path::{Path, PathBuf};

use camera_model::pose_from_euler;
use commands::check_name;
use nalgebra::{Isometry3, Vector3};
use pipeline::{Error, Result};
use range_io::{read_ron_text, ron_text};
use serde::{Deserialize, Serialize};

/// The cameras of a rig, read from `rig.ron`. Paths are relative to its folder.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RigFile {
    /// The cameras; the first one is the frame of the rig.
    pub cameras: Vec<CameraEntry>,
}

/// A camera of a rig.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraEntry {
    /// Its name, after which its folder of results is called.
    pub name: String,
    /// Folder of its survey; default: that of its name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub folder: Option<PathBuf>,
    /// Terms that are estimated, by their canonical names; an empty list holds its calibration. Default: those of the command.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub terms: Option<Vec<String>>,
    /// About where it sits, by ruler (to 0.1 m and 10 degrees): no start value, but cameras that are taken for each other
    /// are noticed. Not of the first camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub about: Option<RigPose>,
}

/// A pose in the frame of the rig: perspective centre and rotation as in `stations.csv`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RigPose {
    /// Perspective centre, metre.
    pub x_m: f64,
    /// The same along y.
    pub y_m: f64,
    /// The same along z.
    pub z_m: f64,
    /// First rotation angle, degree.
    pub omega_deg: f64,
    /// Second.
    pub phi_deg: f64,
    /// Third.
    pub kappa_deg: f64,
}

impl RigPose {
    /// The pose, `rig_from_camera`.
    pub fn rig_from_camera(&self) -> Isometry3<f64> {
        let angles = [self.omega_deg, self.phi_deg, self.kappa_deg].map(f64::to_radians);
        pose_from_euler(Vector3::new(self.x_m, self.y_m, self.z_m), angles)
    }

    fn is_finite(&self) -> bool {
        let Self { x_m, y_m, z_m, omega_deg, phi_deg, kappa_deg } = self;
        [x_m, y_m, z_m, omega_deg, phi_deg, kappa_deg].into_iter().all(|value| value.is_finite())
    }
}

/// Whether a folder is that of a rig: it has a `rig.ron`.
pub fn is_rig(folder: &Path) -> bool {
    folder.join(RigFile::FILE_NAME).is_file()
}

impl RigFile {
    /// Name of the file.
    pub const FILE_NAME: &str = "rig.ron";

    /// Reads and checks the file in a folder.
    ///
    /// # Errors
    /// What is wrong, with file, line and field; fewer than two cameras; names that are empty, doubled or no names of folders.
    pub fn read(folder: &Path) -> Result<Self> {
        let path = folder.join(Self::FILE_NAME);
        Self::parse(&path, &read_ron_text(&path)?)
    }

    /// Reads and checks the text of a `rig.ron`; `path` stands for it in messages.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn parse(path: &Path, text: &str) -> Result<Self> {
        let rig: Self = ron_text::parse(path, text)?;
        let wrong = |message: String| Err(Error::Survey { path: path.to_owned(), message });
        if rig.cameras.len() < 2 {
            let count = rig.cameras.len();
            return wrong(format!(
                "names {count} camera(s), expected two or more: calibrate one camera's survey by itself"
            ));
        }
        for (index, camera) in rig.cameras.iter().enumerate() {
            check_name(path, &camera.name)?;
            let earlier = &rig.cameras[..index];
            if earlier.iter().any(|other| other.name == camera.name) {
                return wrong(format!("names two cameras `{}`", camera.name));
            }
            if let Some(other) = earlier.iter().find(|other| other.folder() == camera.folder()) {
                return wrong(format!("gives cameras `{}` and `{}` one folder", other.name, camera.name));
            }
            if camera.about.is_some_and(|about| !about.is_finite()) {
                return wrong(format!("has numbers in `about` of camera `{}` that are not finite", camera.name));
            }
            if index == 0 && camera.about.is_some() {
                return wrong(format!(
                    "says `about` of camera `{}`, which is the frame of the rig: leave it out",
                    camera.name
                ));
            }
        }
        Ok(rig)
    }
}

impl CameraEntry {
    /// Folder of its survey, relative to that of the rig.
    pub fn folder(&self) -> &Path {
        self.folder.as_deref().unwrap_or(Path::new(&self.name))
    }
}
