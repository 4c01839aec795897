//! Two states of the body against the motion between them.

use nalgebra::{Isometry3, Matrix3, SMatrix, SVector, Translation3, Vector3};

use crate::noise::Biases;
use crate::preintegrated::{Matrix9x6, POSITION, Preintegrated, ROTATION, VELOCITY};
use rigid_pose::{inverse_left_jacobian, left_jacobian};

/// Rotation, velocity and position, three components each.
pub type Vector9 = SVector<f64, 9>;

/// Pose and velocity of the body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NavigationState {
    /// The pose.
    pub world_from_body: Isometry3<f64>,
    /// The velocity, world axes, metre per second.
    pub velocity: Vector3<f64>,
}

/// Derivatives of [`Preintegrated::residual`]; poses by their tangent `[dt (world axes), dθ (body axes)]`.
#[derive(Debug, Clone, PartialEq)]
pub struct ResidualJacobians {
    /// By the pose at the start.
    pub start_pose: Matrix9x6,
    /// By the velocity at the start.
    pub start_velocity: SMatrix<f64, 9, 3>,
    /// By the pose at the end.
    pub end_pose: Matrix9x6,
    /// By the velocity at the end.
    pub end_velocity: SMatrix<f64, 9, 3>,
    /// By `[gyro bias, accel bias]`.
    pub biases: Matrix9x6,
    /// By gravity, world axes.
    pub gravity: SMatrix<f64, 9, 3>,
}

impl Preintegrated {
    /// The state at the end of the interval. `gravity`: world axes, downwards, m/s².
    #[must_use]
    pub fn predict(&self, start: &NavigationState, gravity: &Vector3<f64>, biases: &Biases) -> NavigationState {
        let motion = self.corrected(biases);
        let (rotation, t) = (start.world_from_body.rotation, self.seconds);
        let position = start.world_from_body.translation.vector
            + start.velocity * t
            + gravity * (t * t / 2.0)
            + rotation * motion.position;
        NavigationState {
            world_from_body: Isometry3::from_parts(Translation3::from(position), rotation * motion.rotation),
            velocity: start.velocity + gravity * t + rotation * motion.velocity,
        }
    }

    /// States minus measured motion, with the covariance [`Self::covariance`]: `[log(ΔRᵀ Rᵀ R'), Rᵀ(v' − v − g T) − Δv,
    /// Rᵀ(p' − p − v T − g T²/2) − Δp]`.
    #[must_use]
    pub fn residual(
        &self,
        start: &NavigationState,
        end: &NavigationState,
        gravity: &Vector3<f64>,
        biases: &Biases,
    ) -> Vector9 {
        self.residual_with_jacobians(start, end, gravity, biases).0
    }

    /// The same with its derivatives.
    #[must_use]
    pub fn residual_with_jacobians(
        &self,
        start: &NavigationState,
        end: &NavigationState,
        gravity: &Vector3<f64>,
        biases: &Biases,
    ) -> (Vector9, ResidualJacobians) {
        let motion = self.corrected(biases);
        let t = self.seconds;
        let (first, second) = (start.world_from_body, end.world_from_body);
        let back = first.rotation.inverse();
        let turn = (motion.rotation.inverse() * back * second.rotation).scaled_axis();
        let faster = back * (end.velocity - start.velocity - gravity * t);
        let way = second.translation.vector - first.translation.vector;
        let moved = back * (way - start.velocity * t - gravity * (t * t / 2.0));
        let mut residual = Vector9::zeros();
        residual.fixed_rows_mut::<3>(ROTATION).copy_from(&turn);
        residual.fixed_rows_mut::<3>(VELOCITY).copy_from(&(faster - motion.velocity));
        residual.fixed_rows_mut::<3>(POSITION).copy_from(&(moved - motion.position));

        let inverse = inverse_left_jacobian(&turn).transpose();
        let r_back = back.to_rotation_matrix().into_inner();
        let r_between: Matrix3<f64> = (second.rotation.inverse() * first.rotation).to_rotation_matrix().into_inner();
        let mut jacobians = ResidualJacobians {
            start_pose: Matrix9x6::zeros(),
            start_velocity: SMatrix::zeros(),
            end_pose: Matrix9x6::zeros(),
            end_velocity: SMatrix::zeros(),
            biases: Matrix9x6::zeros(),
            gravity: SMatrix::zeros(),
        };
        // exp(−δ) Rᵀ a = Rᵀ a + [Rᵀ a]x δ; log(ΔRᵀ exp(−δ) Rᵀ R') turns back through R'ᵀ R.
        let mut of = |row: usize, column: usize, block: Matrix3<f64>| {
            jacobians.start_pose.fixed_view_mut::<3, 3>(row, column).copy_from(&block);
        };
        of(ROTATION, 3, -inverse * r_between);
        of(VELOCITY, 3, faster.cross_matrix());
        of(POSITION, 3, moved.cross_matrix());
        of(POSITION, 0, -r_back);
        jacobians.end_pose.fixed_view_mut::<3, 3>(ROTATION, 3).copy_from(&inverse);
        jacobians.end_pose.fixed_view_mut::<3, 3>(POSITION, 0).copy_from(&r_back);
        jacobians.start_velocity.fixed_view_mut::<3, 3>(VELOCITY, 0).copy_from(&-r_back);
        jacobians.start_velocity.fixed_view_mut::<3, 3>(POSITION, 0).copy_from(&(-r_back * t));
        jacobians.end_velocity.fixed_view_mut::<3, 3>(VELOCITY, 0).copy_from(&r_back);
        jacobians.gravity.fixed_view_mut::<3, 3>(VELOCITY, 0).copy_from(&(-r_back * t));
        jacobians.gravity.fixed_view_mut::<3, 3>(POSITION, 0).copy_from(&(-r_back * (t * t / 2.0)));
        // ΔR exp(J b) grows by exp(Jr(J b) J δ), and log(exp(−δ') exp(turn)) = turn − J⁻¹ exp(turn)ᵀ δ'.
        let effect =
            (self.by_biases * (biases.to_vector() - self.biases.to_vector())).fixed_rows::<3>(ROTATION).into_owned();
        let undone = nalgebra::UnitQuaternion::from_scaled_axis(-turn).to_rotation_matrix().into_inner();
        let by_rotation = -inverse * undone * left_jacobian(&effect).transpose();
        jacobians.biases = -self.by_biases;
        let turned = by_rotation * self.by_biases.fixed_rows::<3>(ROTATION);
        jacobians.biases.fixed_rows_mut::<3>(ROTATION).copy_from(&turned);
        (residual, jacobians)
    }
}
