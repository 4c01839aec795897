//! Unit quaternion `[Horn1987]`.

use nalgebra::{Matrix3, Matrix4, UnitQuaternion};

use super::quaternion_of_largest;
use crate::error::Result;

/// Eigenvector of the largest eigenvalue of Horn's symmetric 4x4 matrix; `cross` = `Σ w p' q'^T`.
pub(super) fn rotation(cross: &Matrix3<f64>) -> Result<UnitQuaternion<f64>> {
    let s = cross / cross.norm().max(f64::MIN_POSITIVE);
    let (xx, xy, xz) = (s[(0, 0)], s[(0, 1)], s[(0, 2)]);
    let (yx, yy, yz) = (s[(1, 0)], s[(1, 1)], s[(1, 2)]);
    let (zx, zy, zz) = (s[(2, 0)], s[(2, 1)], s[(2, 2)]);
    #[rustfmt::skip]
    let horn = Matrix4::new(
        xx + yy + zz, yz - zy,      zx - xz,       xy - yx,
        yz - zy,      xx - yy - zz, xy + yx,       zx + xz,
        zx - xz,      xy + yx,      -xx + yy - zz, yz + zy,
        xy - yx,      zx + xz,      yz + zy,       -xx - yy + zz,
    );
    quaternion_of_largest(horn, 1.0, "Horn's eigenvalue problem")
}
