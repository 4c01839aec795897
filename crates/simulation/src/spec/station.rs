use camera_model::pose_from_euler;
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::check::{coordinates, finite, require};
use crate::Result;

/// One place from which frames are taken.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StationSpec {
    /// Name, unlike those of the other stations.
    pub name: String,
    /// Perspective centre in the world.
    pub position_m: [f64; 3],
    /// Where the camera looks.
    pub attitude: AttitudeSpec,
}

/// Attitude of a camera that looks along its -z axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum AttitudeSpec {
    /// Rotation from object to camera, `R3(kappa) R2(phi) R1(omega)` (Eq. 2).
    Euler {
        /// About the x axis.
        omega_deg: f64,
        /// About the turned y axis.
        phi_deg: f64,
        /// About the turned z axis.
        kappa_deg: f64,
    },
    /// The camera looks at a point, its x axis level; then it is rolled about its viewing direction.
    LookAt {
        /// Point on the viewing axis.
        target_m: [f64; 3],
        /// Roll of the camera, clockwise as its user sees it.
        #[serde(default)]
        roll_deg: f64,
    },
}

impl StationSpec {
    pub(crate) fn validate(&self, path: &str) -> Result<()> {
        coordinates(format!("{path}.position_m"), &self.position_m)?;
        match self.attitude {
            AttitudeSpec::Euler { omega_deg, phi_deg, kappa_deg } => {
                finite(format!("{path}.attitude.omega_deg"), omega_deg)?;
                finite(format!("{path}.attitude.phi_deg"), phi_deg)?;
                finite(format!("{path}.attitude.kappa_deg"), kappa_deg)
            }
            AttitudeSpec::LookAt { target_m, roll_deg } => {
                coordinates(format!("{path}.attitude.target_m"), &target_m)?;
                finite(format!("{path}.attitude.roll_deg"), roll_deg)?;
                let view = Vector3::from(target_m) - Vector3::from(self.position_m);
                let level = view.norm() > 0.0 && view.cross(&Vector3::z()).norm() > 1e-9 * view.norm();
                let expected = "a point neither at the station nor straight above or below it; use Euler there";
                require(level, format!("{path}.attitude.target_m"), &target_m, expected)
            }
        }
    }

    /// The pose that the station stands for. Meaningful for a station that passed the checks of its simulation.
    pub fn world_from_camera(&self) -> Isometry3<f64> {
        match self.attitude {
            AttitudeSpec::Euler { omega_deg, phi_deg, kappa_deg } => {
                let angles = [omega_deg, phi_deg, kappa_deg].map(f64::to_radians);
                pose_from_euler(self.position_m, angles)
            }
            AttitudeSpec::LookAt { target_m, roll_deg } => {
                look_at(self.position_m.into(), target_m.into(), roll_deg.to_radians())
            }
        }
    }
}

/// Camera axes in the world: -z to the target, x level, y up; then a turn about the camera's z axis.
fn look_at(position: Vector3<f64>, target: Vector3<f64>, roll_rad: f64) -> Isometry3<f64> {
    let backward = (position - target).normalize();
    let right = Vector3::z().cross(&backward).normalize();
    let up = backward.cross(&right);
    let level = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[right, up, backward]));
    let roll = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -roll_rad);
    Isometry3::from_parts(Translation3::from(position), UnitQuaternion::from_rotation_matrix(&level) * roll)
}
