//! The common frame: one station, or inner constraints on all of them.

use nalgebra::{DMatrix, Isometry3, Matrix6, Translation3, UnitQuaternion, Vector3, Vector6};

use crate::adjustment::joint_covariance::JointCovariance;
use rigid_pose::{pose_difference, product_jacobians};

/// What fixes the common frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Datum {
    /// One station keeps its pose.
    Station(usize),
    /// None is preferred: positions and attitudes are on average those at the start, which makes the covariances as
    /// small as they can be.
    InnerConstraints,
}

impl Datum {
    /// The station that is held while the network is solved; inner constraints are applied afterwards.
    pub(crate) fn held_station(self) -> usize {
        match self {
            Self::Station(station) => station,
            Self::InnerConstraints => 0,
        }
    }

    /// Brings a network that was solved with [`Self::held_station`] into this datum, with the cofactors of its
    /// unknowns `[stations · 6, others]`: the S-transformation `Q ← S Q Sᵀ`, `S = I − G (Gᵀ W G)⁻¹ Gᵀ W` with the
    /// motions G of the network and the weights W that make rotations lengths at `lever_m`.
    pub(crate) fn apply(
        self,
        start: &[Isometry3<f64>],
        poses: Vec<Isometry3<f64>>,
        covariance: JointCovariance,
        lever_m: f64,
    ) -> (Vec<Isometry3<f64>>, JointCovariance) {
        if self != Self::InnerConstraints {
            return (poses, covariance);
        }
        let cofactors = covariance.whole();
        let size = cofactors.nrows();
        let motions = DMatrix::from_fn(size, 6, |r, c| match poses.get(r / 6) {
            Some(pose) => motion(pose)[(r % 6, c)],
            None => 0.0,
        });
        let weighted = DMatrix::from_fn(size, 6, |r, c| motions[(r, c)] * weight(r % 6, lever_m));
        let Some(inverse) = (motions.transpose() * &weighted).try_inverse() else { return (poses, covariance) };
        let change = DMatrix::identity(size, size) - &motions * inverse * weighted.transpose();
        let centred = centred(start, &poses, lever_m);
        // Translations are along the axes of the world, which turns with the stations.
        let mut turned = DMatrix::identity(size, size);
        for (k, (before, after)) in poses.iter().zip(&centred).enumerate() {
            let turn = (after.rotation * before.rotation.inverse()).to_rotation_matrix().into_inner();
            turned.fixed_view_mut::<3, 3>(6 * k, 6 * k).copy_from(&turn);
        }
        let change = turned * change;
        (centred, JointCovariance::of_whole(&change * cofactors * change.transpose()))
    }
}

fn weight(component: usize, lever_m: f64) -> f64 {
    if component < 3 { 1.0 } else { lever_m * lever_m }
}

/// How the tangent `[dt world, dtheta station]` of a pose changes when the world moves by `[shift, turn]`.
fn motion(pose: &Isometry3<f64>) -> Matrix6<f64> {
    product_jacobians(&Isometry3::identity(), pose).0
}

/// Moves all poses together so that they are on average those at the start.
fn centred(start: &[Isometry3<f64>], poses: &[Isometry3<f64>], lever_m: f64) -> Vec<Isometry3<f64>> {
    let mut poses = poses.to_vec();
    // Differences are small: each pass squares the error.
    for _ in 0..5 {
        let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
        let weights = Matrix6::from_fn(|r, c| if r == c { weight(r, lever_m) } else { 0.0 });
        for (pose, start) in poses.iter().zip(start) {
            let motion = motion(pose);
            normal += motion.transpose() * weights * motion;
            right += motion.transpose() * weights * pose_difference(pose, start);
        }
        let Some(step) = normal.try_inverse().map(|inverse| inverse * right) else { return poses };
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(step[3], step[4], step[5]));
        let shift = Translation3::new(step[0], step[1], step[2]);
        for pose in &mut poses {
            *pose = Isometry3::from_parts(shift, turn) * *pose;
            pose.rotation.renormalize();
        }
    }
    poses
}
