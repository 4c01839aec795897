//! Poses as numbers in files.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

/// Largest deviation of a quaternion's length from 1: files with three decimals are common.
pub(crate) const LENGTH_TOLERANCE: f64 = 5e-3;

/// Pose of a translation and a quaternion `x y z w`; `None` where they are not three and four finite numbers or the
/// quaternion is no rotation.
pub(crate) fn pose_of(translation: &[f64], quaternion: &[f64]) -> Option<Isometry3<f64>> {
    let (&[tx, ty, tz], &[qx, qy, qz, qw]) = (translation, quaternion) else { return None };
    let rotation = Quaternion::new(qw, qx, qy, qz);
    let sound = [tx, ty, tz].iter().all(|value| value.is_finite()) && (rotation.norm() - 1.0).abs() <= LENGTH_TOLERANCE;
    // A NaN in the quaternion fails the comparison.
    sound.then(|| Isometry3::from_parts(Translation3::new(tx, ty, tz), UnitQuaternion::from_quaternion(rotation)))
}

/// Translation and quaternion `x y z w`; `None` where one is not finite.
#[cfg(any(feature = "e57", feature = "pcd", feature = "ply"))]
pub(crate) fn numbers_of(pose: &Isometry3<f64>) -> Option<[f64; 7]> {
    let (t, q) = (pose.translation.vector, pose.rotation.coords);
    let numbers = [t.x, t.y, t.z, q.x, q.y, q.z, q.w];
    numbers.iter().all(|value| value.is_finite()).then_some(numbers)
}
