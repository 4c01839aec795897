//! What the motions can tell at all.

use nalgebra::{Isometry3, Matrix3, SymmetricEigen, Vector3};
use statistics::chi_squared_limit;

use crate::mounting::closed_form::Motion;

/// Level of the test whether there is a rotation: noise alone passes for one once in a thousand.
const LEVEL: f64 = 0.001;
/// Standard deviations within which the angles of carrier and camera agree: one motion in 16,000 does not.
const SAME_ANGLE: f64 = 4.0;
/// Factor by which the scatter about an axis must exceed what noise makes once in a thousand: rotations of twice their noise.
/// Smaller ones would give a lever arm that is known to its own length at best.
const CLEAR: f64 = 4.0;
/// Poses tried as the one that all others are turned against: one of ten is sound.
const REFERENCES: usize = 10;

/// A part of the mounting that the motions leave open.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Undetermined {
    /// The lever arm, whole: the carrier never turned.
    LeverArm,
    /// The lever arm along an axis (unit vector, carrier axes): the carrier turned about that one only.
    LeverArmAlong(Vector3<f64>),
    /// The rotation of the camera: neither rotations about two axes nor shifts in two directions.
    Boresight,
    /// The time offset: the carrier hardly moved while the camera looked.
    TimeOffset,
}

impl std::fmt::Display for Undetermined {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::LeverArm => f.write_str("the lever arm (the carrier did not turn)"),
            Self::LeverArmAlong(axis) => write!(
                f,
                "the lever arm along [{:.3}, {:.3}, {:.3}] (the carrier turned about that axis only)",
                axis.x, axis.y, axis.z
            ),
            Self::Boresight => {
                f.write_str("the camera's rotation (no rotations about two axes, no shifts in two directions)")
            }
            Self::TimeOffset => f.write_str("the time offset (the carrier hardly moved)"),
        }
    }
}

/// Which part of the lever arm the poses (world from carrier, target from camera) leave open, from the scatter of the carrier's
/// rotation vectors. Poses count where carrier and camera have turned by the same angle, so that a gross error makes no axis.
/// `variances`: of an angle of carrier and camera together, radian².
pub(crate) fn open_lever_arm(poses: &[[Isometry3<f64>; 2]], variances: &[f64]) -> Option<Undetermined> {
    let turns = |reference: usize| {
        let sound = poses.iter().zip(variances).filter_map(move |(pose, variance)| {
            let [carrier, camera] = Motion::between(&poses[reference], pose).turns();
            let deviation = (variance + variances[reference]).sqrt();
            ((carrier.norm() - camera.norm()).abs() <= SAME_ANGLE * deviation).then_some((carrier, *variance))
        });
        sound.collect::<Vec<_>>()
    };
    let turns = (0..poses.len().min(REFERENCES)).map(turns).max_by_key(Vec::len).unwrap_or_default();
    let weight: f64 = turns.iter().map(|(_, variance)| 1.0 / variance).sum();
    // About their mean: the error of the reference turns all of them alike.
    let mean = turns.iter().map(|(turn, variance)| turn / *variance).sum::<Vector3<f64>>() / weight;
    let scatter: Matrix3<f64> =
        turns.iter().map(|(turn, variance)| (turn - mean) * (turn - mean).transpose() / *variance).sum();
    let limit = CLEAR * chi_squared_limit(turns.len().saturating_sub(1) as f64, LEVEL);
    let Some(eigen) = SymmetricEigen::try_new(scatter, f64::EPSILON, 1000) else { return Some(Undetermined::LeverArm) };
    let [largest, smallest] = [eigen.eigenvalues.imax(), eigen.eigenvalues.imin()];
    let middle = (0..3).find(|k| *k != largest && *k != smallest).unwrap_or(smallest);
    // Not `<=`: what is no number is no rotation.
    let is_clear = |k: usize| eigen.eigenvalues[k] > limit;
    let axis = eigen.eigenvectors.column(largest).into_owned();
    match (is_clear(largest), is_clear(middle)) {
        (true, true) => None,
        (true, false) => Some(Undetermined::LeverArmAlong(axis)),
        _ => Some(Undetermined::LeverArm),
    }
}
