//! The state of a body at a moment, and where the unit leads from there.

use nalgebra::{Isometry3, Matrix3, Matrix6, SMatrix, Vector3, Vector6};
use rigid_pose::{Uncertain, pose_difference, step_pose};

use crate::noise::{Biases, ImuNoise};
use crate::preintegrated::Preintegrated;
use crate::residual::NavigationState;
use crate::rest::{GRAVITY_M_S2, Rest, rest};
use crate::sample::InertialSample;
use crate::{Error, Result};

/// Covariance of a whole state: pose (6), velocity (3), biases (6), gravity (3).
pub type StateCovariance = SMatrix<f64, 18, 18>;

const VELOCITY: usize = 6;
const GYRO: usize = 9;
const ACCEL: usize = 12;
const GRAVITY: usize = 15;

/// Velocity that passes for rest, m/s: a tripod on a floor, a hand that waits.
const RESTING_VELOCITY: f64 = 1e-3;
/// Standard deviation of the length of gravity, m/s²: what it differs by from the poles to the equator.
pub(crate) const GRAVITY_SIGMA_M_S2: f64 = 0.02;

/// State of the unit's body at a moment, with everything that its way on depends on, and one covariance of it all.
#[derive(Debug, Clone, PartialEq)]
pub struct InertialState {
    /// The moment, second.
    pub time_s: f64,
    /// Pose and velocity.
    pub navigation: NavigationState,
    /// Biases.
    pub biases: Biases,
    /// Gravity, world axes, m/s².
    pub gravity: Vector3<f64>,
    /// Of `[dt (world axes), dθ (body axes), velocity, gyro bias, accel bias, gravity]`, three each. A bias of the forces and gravity
    /// can hardly be told apart, while what they make of a motion is known well: they are one covariance for that.
    pub covariance: StateCovariance,
}

impl InertialState {
    /// The state at a pose that is known, up to which the unit has rested: its rates are their bias, its forces gravity and their bias, of
    /// which the known length of gravity tells one component.
    ///
    /// # Errors
    /// [`Error::Unrest`] where the samples up to `time_s` are not those of a unit at rest, [`Error::NonFinite`], [`Error::NotAscending`],
    /// [`Error::InvalidOption`].
    ///
    /// ```
    /// use inertial::nalgebra::{Isometry3, Vector3};
    /// use inertial::rigid_pose::Uncertain;
    /// use inertial::{ImuNoise, InertialSample, InertialState};
    ///
    /// let sample = |k: i32| InertialSample {
    ///     timestamp_s: f64::from(k) * 0.01,
    ///     angular_rate: Vector3::zeros(),
    ///     specific_force: Vector3::new(0.0, 9.80665, 0.0),
    /// };
    /// let samples: Vec<_> = (0..200).map(sample).collect();
    /// let noise = ImuNoise::default();
    /// let start = InertialState::at_rest(&samples, 1.0, &Uncertain::exact(Isometry3::identity()), &noise)?;
    /// let later = start.carried(&samples, 1.5, &noise)?;
    /// assert!(later.pose().pose.translation.vector.norm() < 1e-9);
    /// # Ok::<(), inertial::Error>(())
    /// ```
    pub fn at_rest(
        samples: &[InertialSample],
        time_s: f64,
        world_from_body: &Uncertain,
        noise: &ImuNoise,
    ) -> Result<Self> {
        noise.check()?;
        InertialSample::check(samples)?;
        let resting = &samples[..samples.partition_point(|sample| sample.timestamp_s <= time_s)];
        let found = rest(resting, noise)?;
        let Rest { rate, force, seconds } = found;
        let rotation = world_from_body.pose.rotation.to_rotation_matrix().into_inner();
        // Errors that are independent of each other: pose, velocity, gyro bias, accel bias, mean force.
        let mut own = StateCovariance::zeros();
        own.fixed_view_mut::<6, 6>(0, 0).copy_from(&world_from_body.covariance);
        let variances = [
            (VELOCITY, RESTING_VELOCITY.powi(2)),
            (GYRO, found.rate_variance(noise)),
            (ACCEL, noise.accel_bias_sigma.powi(2)),
            (GRAVITY, noise.accel_density.powi(2) / seconds + noise.accel_walk.powi(2) * seconds / 3.0),
        ];
        for (at, variance) in variances {
            own.fixed_view_mut::<3, 3>(at, at).copy_from(&(Matrix3::identity() * variance));
        }
        // g = −R (f − b), with the errors of R, the bias and the mean of f in it.
        let mut all = StateCovariance::identity();
        all.fixed_view_mut::<3, 3>(GRAVITY, 3).copy_from(&(rotation * force.cross_matrix()));
        all.fixed_view_mut::<3, 3>(GRAVITY, ACCEL).copy_from(&rotation);
        all.fixed_view_mut::<3, 3>(GRAVITY, GRAVITY).copy_from(&-rotation);
        let navigation = NavigationState { world_from_body: world_from_body.pose, velocity: Vector3::zeros() };
        let biases = Biases { gyro: rate, accel: Vector3::zeros() };
        let gravity = -(rotation * force);
        let mut state = Self { time_s, navigation, biases, gravity, covariance: all * own * all.transpose() };
        let up = SMatrix::<f64, 1, 18>::from_fn(
            |_, k| if k < GRAVITY { 0.0 } else { gravity[k - GRAVITY] / gravity.norm() },
        );
        let variance = SMatrix::<f64, 1, 1>::new(GRAVITY_SIGMA_M_S2.powi(2));
        state.observe(&up, &SMatrix::<f64, 1, 1>::new(GRAVITY_M_S2 - gravity.norm()), &variance)?;
        Ok(state)
    }

    /// The body's pose with its covariance.
    #[must_use]
    pub fn pose(&self) -> Uncertain {
        let covariance = self.covariance.fixed_view::<6, 6>(0, 0).into_owned();
        Uncertain { pose: self.navigation.world_from_body, covariance }
    }

    /// The state at a later time by the unit alone; the same state for a time that is not later. Samples ascend in time.
    ///
    /// Biases walk meanwhile: the motion sees their mean, whose variance is a third of that at the end `[Forster2017]`.
    ///
    /// # Errors
    /// [`Error::Gap`] where samples are missing, [`Error::NonFinite`], [`Error::NotAscending`], [`Error::InvalidOption`].
    pub fn carried(&self, samples: &[InertialSample], time_s: f64, noise: &ImuNoise) -> Result<Self> {
        if time_s <= self.time_s {
            return Ok(self.clone());
        }
        let motion = Preintegrated::new(samples, [self.time_s, time_s], &self.biases, noise)?;
        let navigation = motion.predict(&self.navigation, &self.gravity, &self.biases);
        let (_, by) = motion.residual_with_jacobians(&self.navigation, &navigation, &self.gravity, &self.biases);
        let mut by_state = SMatrix::<f64, 9, 18>::zeros();
        by_state.fixed_view_mut::<9, 6>(0, 0).copy_from(&by.start_pose);
        by_state.fixed_view_mut::<9, 3>(0, VELOCITY).copy_from(&by.start_velocity);
        by_state.fixed_view_mut::<9, 6>(0, GYRO).copy_from(&by.biases);
        by_state.fixed_view_mut::<9, 3>(0, GRAVITY).copy_from(&by.gravity);
        // The residual (rotation, velocity, position) is zero at the end: by the end's attitude its derivative is one, by velocity and
        // position the way back into the axes of the start.
        let rotation = self.navigation.world_from_body.rotation.to_rotation_matrix().into_inner();
        let mut end = SMatrix::<f64, 9, 9>::zeros();
        end.fixed_view_mut::<3, 3>(0, 6).copy_from(&rotation);
        end.fixed_view_mut::<3, 3>(3, 0).copy_from(&Matrix3::identity());
        end.fixed_view_mut::<3, 3>(6, 3).copy_from(&rotation);
        let mut transition = StateCovariance::identity();
        transition.fixed_view_mut::<9, 18>(0, 0).copy_from(&(-end * by_state));
        let by_biases = -end * by.biases;
        let (gyro, accel) = (noise.gyro_walk.powi(2) * motion.seconds, noise.accel_walk.powi(2) * motion.seconds);
        let walk = Matrix6::from_diagonal(&Vector6::new(gyro, gyro, gyro, accel, accel, accel));
        let mut added = StateCovariance::zeros();
        let of_motion = end * motion.covariance * end.transpose() + by_biases * (walk / 3.0) * by_biases.transpose();
        added.fixed_view_mut::<9, 9>(0, 0).copy_from(&of_motion);
        let mixed = by_biases * (walk / 2.0);
        added.fixed_view_mut::<9, 6>(0, GYRO).copy_from(&mixed);
        added.fixed_view_mut::<6, 9>(GYRO, 0).copy_from(&mixed.transpose());
        added.fixed_view_mut::<6, 6>(GYRO, GYRO).copy_from(&walk);
        let covariance = symmetrised(&(transition * self.covariance * transition.transpose() + added));
        Ok(Self { time_s, navigation, covariance, ..self.clone() })
    }

    /// Corrects the whole state by a measured pose of the body, whose errors are independent of it.
    ///
    /// # Errors
    /// [`Error::InvalidCovariance`] where the covariance is not positive definite.
    pub fn learn(&mut self, world_from_body: &Uncertain) -> Result<()> {
        let difference = pose_difference(&self.navigation.world_from_body, &world_from_body.pose);
        let mut by_state = SMatrix::<f64, 6, 18>::zeros();
        by_state.fixed_view_mut::<6, 6>(0, 0).fill_with_identity();
        self.observe(&by_state, &difference, &world_from_body.covariance)
    }

    /// The same state in the axes that the body has: its pose is the identity, and exact.
    #[must_use]
    pub fn in_own_axes(&self) -> Self {
        let back = self.navigation.world_from_body.rotation.inverse();
        let turn = back.to_rotation_matrix().into_inner();
        let (velocity, gravity) = (back * self.navigation.velocity, back * self.gravity);
        let mut by_state = StateCovariance::identity();
        by_state.fixed_view_mut::<6, 6>(0, 0).fill(0.0);
        for (at, vector) in [(VELOCITY, velocity), (GRAVITY, gravity)] {
            by_state.fixed_view_mut::<3, 3>(at, at).copy_from(&turn);
            by_state.fixed_view_mut::<3, 3>(at, 3).copy_from(&vector.cross_matrix());
        }
        let covariance = symmetrised(&(by_state * self.covariance * by_state.transpose()));
        let navigation = NavigationState { world_from_body: Isometry3::identity(), velocity };
        Self { navigation, gravity, covariance, ..self.clone() }
    }

    /// What linear observations with this derivative, misclosure and covariance make of the state `[Kalman1960]`; the covariance in the
    /// form that stays positive.
    fn observe<const N: usize>(
        &mut self,
        by_state: &SMatrix<f64, N, 18>,
        misclosure: &SMatrix<f64, N, 1>,
        covariance: &SMatrix<f64, N, N>,
    ) -> Result<()> {
        let shared = by_state * self.covariance;
        let total = shared * by_state.transpose() + covariance;
        let factor =
            ((total + total.transpose()) * 0.5).cholesky().filter(|_| covariance.iter().all(|v| v.is_finite()));
        let factor = factor.ok_or(Error::InvalidCovariance)?;
        let gain = factor.solve(&shared).transpose();
        let step = gain * misclosure;
        let kept = StateCovariance::identity() - gain * by_state;
        self.covariance =
            symmetrised(&(kept * self.covariance * kept.transpose() + gain * covariance * gain.transpose()));
        let NavigationState { world_from_body, velocity } = self.navigation;
        let world_from_body = step_pose(&world_from_body, &step.fixed_rows::<6>(0).into_owned());
        self.navigation = NavigationState { world_from_body, velocity: velocity + step.fixed_rows::<3>(VELOCITY) };
        self.biases = Biases::from_vector(&(self.biases.to_vector() + step.fixed_rows::<6>(GYRO)));
        self.gravity += step.fixed_rows::<3>(GRAVITY);
        Ok(())
    }
}

fn symmetrised(matrix: &StateCovariance) -> StateCovariance {
    (matrix + matrix.transpose()) * 0.5
}
