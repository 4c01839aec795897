//! Closed-form absolute orientation from point pairs, by the four ways that `[Eggert1997]` compares.

mod dual_quaternion;
mod moments;
mod orthonormal;
mod quaternion;
mod svd;

use nalgebra::{Isometry3, Matrix4, Matrix6, Point3, Quaternion, SymmetricEigen, UnitQuaternion};

use crate::error::{InputError, Result};
use moments::Moments;

/// Relative gap of the criterion below which two rotations fit equally well to within rounding.
const AMBIGUOUS_GAP: f64 = 1e-12;

/// How the rotation is found. All minimise the same sum; they differ in what rounding does to them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum RotationMethod {
    /// Eigenvector of a symmetric 4x4 matrix `[Horn1987]`.
    #[default]
    UnitQuaternion,
    /// Singular values of the 3x3 cross moments `[Arun1987]`, with the sign of `[Umeyama1991]`.
    SingularValues,
    /// Square root of the 3x3 cross moments `[Horn1988]`. Squaring them costs half the digits where points nearly form
    /// a line.
    OrthonormalMatrices,
    /// Rotation and translation at once `[Walker1991]`. Works on unreduced coordinates: digits go where the points are
    /// far from the origin compared with their extent.
    DualQuaternions,
}

/// Rigid motion that carries source points onto target points, with its quality.
#[derive(Debug, Clone, PartialEq)]
pub struct Orientation {
    /// Pose: `target = target_from_source * source`.
    pub target_from_source: Isometry3<f64>,
    /// Weighted root mean square distance left between the pairs, metre.
    pub rms_m: f64,
    /// A posteriori standard deviation of one coordinate of unit weight, metre; NaN without redundancy.
    pub sigma0_m: f64,
    /// Redundancy `3n - 6` (`3n - 7` with scale), n = pairs of positive weight.
    pub redundancy: usize,
    /// Inverse of the normal matrix for unit sigma0, tangent `[dt target axes, dtheta source axes]`.
    pub cofactor: Matrix6<f64>,
    /// `sigma0² · cofactor`: metre² and radian²; NaN without redundancy.
    pub covariance: Matrix6<f64>,
}

/// A similarity: scale besides the rigid motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Similarity {
    /// `target = target_from_source * (scale * source)`; the orientation's covariance is that at this fixed scale.
    pub orientation: Orientation,
    /// Scale factor.
    pub scale: f64,
    /// Standard deviation of the scale (from the posterior sigma0); NaN without redundancy.
    pub scale_sigma: f64,
}

/// Rigid motion that minimises `Σ w |target − (R source + t)|²`.
///
/// `source` and `target`: n ≥ 3 pairs, metre; `weights`: n values ≥ 0 (1/σ² of a pair, up to a factor), `None` = 1.
/// Closed form after `[Horn1987]`; the covariance is that of the least-squares problem at the solution.
///
/// # Errors
/// [`InputError::LengthMismatch`], [`InputError::NonFinite`], [`InputError::NotPositive`], [`InputError::TooFewPoints`] below three pairs
/// of positive weight, [`InputError::Collinear`] naming the side, [`InputError::AmbiguousRotation`].
pub fn absolute_orientation(
    source: &[Point3<f64>],
    target: &[Point3<f64>],
    weights: Option<&[f64]>,
) -> Result<Orientation> {
    absolute_orientation_by(RotationMethod::default(), source, target, weights)
}

/// As [`absolute_orientation`], by a method of choice.
///
/// # Errors
/// Those of [`absolute_orientation`].
pub fn absolute_orientation_by(
    method: RotationMethod,
    source: &[Point3<f64>],
    target: &[Point3<f64>],
    weights: Option<&[f64]>,
) -> Result<Orientation> {
    let moments = Moments::new(source, target, weights)?;
    let rotation = match method {
        RotationMethod::UnitQuaternion => quaternion::rotation(&moments.cross)?,
        RotationMethod::SingularValues => svd::rotation(&moments.cross)?,
        RotationMethod::OrthonormalMatrices => orthonormal::rotation(&moments.cross)?,
        RotationMethod::DualQuaternions => dual_quaternion::rotation(source, target, weights, moments.cross.norm())?,
    };
    Ok(moments.orientation(source, target, weights, rotation, 1.0, 6))
}

/// Similarity that minimises `Σ w |target − (s R source + t)|²`.
///
/// Arguments and errors as [`absolute_orientation`]. The scale is the least-squares one of `[Umeyama1991]`, which takes
/// the target as measured and the source as given.
pub fn absolute_orientation_with_scale(
    source: &[Point3<f64>],
    target: &[Point3<f64>],
    weights: Option<&[f64]>,
) -> Result<Similarity> {
    let moments = Moments::new(source, target, weights)?;
    let rotation = quaternion::rotation(&moments.cross)?;
    let spread = moments.source_scatter.trace();
    let r = rotation.to_rotation_matrix();
    // Σ w q'·(R p') / Σ w |p'|²
    let scale = (r.matrix().transpose().component_mul(&moments.cross)).sum() / spread;
    let orientation = moments.orientation(source, target, weights, rotation, scale, 7);
    let scale_sigma = orientation.sigma0_m / spread.sqrt();
    Ok(Similarity { orientation, scale, scale_sigma })
}

/// Refuses a gap between the two best rotations, relative to the criterion, that is rounding.
fn require_gap(gap: f64) -> Result<()> {
    if gap.is_nan() || gap <= AMBIGUOUS_GAP { Err(InputError::AmbiguousRotation { gap }) } else { Ok(()) }
}

/// The eigenvector of the largest eigenvalue as a rotation; `unit` scales the gap to the second.
fn quaternion_of_largest(matrix: Matrix4<f64>, unit: f64, what: &'static str) -> Result<UnitQuaternion<f64>> {
    let eigen = SymmetricEigen::try_new(matrix, 1e-16, 1000)
        .ok_or(InputError::Numerical { what, why: "the iteration did not converge" })?;
    let mut order = [0, 1, 2, 3];
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    require_gap((eigen.eigenvalues[order[0]] - eigen.eigenvalues[order[1]]) / unit)?;
    let v = eigen.eigenvectors.column(order[0]);
    Ok(UnitQuaternion::from_quaternion(Quaternion::new(v[0], v[1], v[2], v[3])))
}
