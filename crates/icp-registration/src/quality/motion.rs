//! Names for motions that the geometry does not determine.

use nalgebra::{DMatrix, Point3, SymmetricEigen, Vector3, Vector6};
use rigid_pose::Centred;

/// Kind of a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MotionKind {
    /// Sliding along the axis.
    Translation,
    /// Turning about the axis.
    Rotation,
}

/// A motion of the source against the target that the pairs say too little about.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UndeterminedMotion {
    /// Sliding or turning.
    pub kind: MotionKind,
    /// Unit vector along the axis, target frame. Its sign is arbitrary.
    pub axis: Vector3<f64>,
    /// A point on the axis (for a translation: the centroid of the pairs), target frame, metre.
    pub through: Point3<f64>,
    /// Predicted standard deviation along the motion of points at the rms radius of the pairs, metre; infinite where
    /// the pairs say nothing.
    pub sigma_m: f64,
}

/// Share of the turning part (a length, as all six) below which a motion is a translation.
const LARGEST_TURN_OF_A_TRANSLATION: f64 = 0.3;

/// Sorts a space of undetermined motions into translations and rotations.
///
/// `space`: orthonormal motions `[dt, rho w]` in `frame` with their sigma. Any mixture of undetermined motions is
/// undetermined; the mixtures returned are those in which as many as possible do not turn.
pub(crate) fn name_motions(space: &[(Vector6<f64>, f64)], frame: &Centred) -> Vec<UndeterminedMotion> {
    let m = space.len();
    if m == 0 {
        return Vec::new();
    }
    let turns = DMatrix::from_fn(3, m, |r, c| space[c].0[3 + r]);
    let Some(eigen) = SymmetricEigen::try_new(turns.transpose() * &turns, 1e-15, 1000) else { return Vec::new() };
    let mut order: Vec<usize> = (0..m).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    order
        .into_iter()
        .map(|k| {
            let mix = eigen.eigenvectors.column(k);
            let motion = space.iter().zip(mix.iter()).fold(Vector6::zeros(), |sum, ((v, _), f)| sum + v * *f);
            let variance: f64 =
                space.iter().zip(mix.iter()).filter(|(_, f)| f.abs() > 1e-3).map(|((_, s), f)| (s * f).powi(2)).sum();
            named(&motion, variance.sqrt(), frame)
        })
        .collect()
}

fn named(motion: &Vector6<f64>, sigma_m: f64, frame: &Centred) -> UndeterminedMotion {
    let slide = Vector3::new(motion[0], motion[1], motion[2]);
    let turn = Vector3::new(motion[3], motion[4], motion[5]);
    if turn.norm() < LARGEST_TURN_OF_A_TRANSLATION {
        let axis = slide / slide.norm();
        return UndeterminedMotion {
            kind: MotionKind::Translation,
            axis,
            through: Point3::from(frame.centre),
            sigma_m,
        };
    }
    // Points of the axis do not move across it: with w the rotation and v the velocity of the centroid they lie at
    // centroid + w x v / |w|².
    let w = turn / frame.radius_m;
    let through = Point3::from(frame.centre + w.cross(&slide) / w.norm_squared());
    UndeterminedMotion { kind: MotionKind::Rotation, axis: turn / turn.norm(), through, sigma_m }
}
