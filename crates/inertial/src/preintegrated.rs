//! The motion between two moments as the inertial unit alone tells it.

use nalgebra::{SMatrix, UnitQuaternion, Vector3, Vector6};

use crate::noise::{Biases, ImuNoise};
use crate::propagation::{Motion, step};
use crate::sample::InertialSample;
use crate::{Error, Result};

/// Covariance and derivatives of a motion: rotation (axes of the end), velocity, position (axes of the start), three each.
pub type Matrix9 = SMatrix<f64, 9, 9>;
/// Derivatives of a motion by `[gyro bias, accel bias]`.
pub type Matrix9x6 = SMatrix<f64, 9, 6>;

pub(crate) const ROTATION: usize = 0;
pub(crate) const VELOCITY: usize = 3;
pub(crate) const POSITION: usize = 6;

/// Rates and forces of an interval summed up on the manifold, independent of pose, velocity and gravity `[Forster2017]`.
///
/// With the pose (R, p) and velocity v of the body at the start, after the time T and with gravity g:
/// `R' = R ΔR`, `v' = v + g T + R Δv`, `p' = p + v T + g T²/2 + R Δp`.
#[derive(Debug, Clone, PartialEq)]
pub struct Preintegrated {
    /// Length of the interval, second.
    pub seconds: f64,
    /// ΔR at the reference biases.
    pub rotation: UnitQuaternion<f64>,
    /// Δv, metre per second.
    pub velocity: Vector3<f64>,
    /// Δp, metre.
    pub position: Vector3<f64>,
    /// Covariance of `[δθ (axes of the end), δΔv, δΔp]` from the noise densities.
    pub covariance: Matrix9,
    /// Derivative of the same by `[gyro bias, accel bias]`.
    pub by_biases: Matrix9x6,
    /// Biases that were taken off the samples.
    pub biases: Biases,
    samples: Vec<InertialSample>,
    noise: ImuNoise,
}

impl Preintegrated {
    /// Sums up the samples from one time to another, second. Samples ascend in time; ends are interpolated.
    ///
    /// # Errors
    /// [`Error::NonFinite`], [`Error::NotAscending`] (also for an interval of no length), [`Error::Gap`] where there is no sample for
    /// longer than [`ImuNoise::max_gap_s`], [`Error::InvalidOption`].
    ///
    /// ```
    /// use inertial::nalgebra::{Isometry3, Vector3};
    /// use inertial::{Biases, ImuNoise, InertialSample, NavigationState, Preintegrated};
    ///
    /// // A second at rest but for a turn of 0.1 rad/s about the vertical.
    /// let samples: Vec<_> = (0..=100)
    ///     .map(|k| InertialSample {
    ///         timestamp_s: f64::from(k) * 0.01,
    ///         angular_rate: Vector3::new(0.0, 0.0, 0.1),
    ///         specific_force: Vector3::new(0.0, 0.0, 9.81),
    ///     })
    ///     .collect();
    /// let motion = Preintegrated::new(&samples, [0.0, 1.0], &Biases::zero(), &ImuNoise::default())?;
    /// let start = NavigationState { world_from_body: Isometry3::identity(), velocity: Vector3::zeros() };
    /// let end = motion.predict(&start, &Vector3::new(0.0, 0.0, -9.81), &Biases::zero());
    /// assert!((end.world_from_body.rotation.angle() - 0.1).abs() < 1e-12);
    /// assert!(end.world_from_body.translation.vector.norm() < 1e-12);
    /// # Ok::<(), inertial::Error>(())
    /// ```
    pub fn new(samples: &[InertialSample], interval_s: [f64; 2], biases: &Biases, noise: &ImuNoise) -> Result<Self> {
        noise.check()?;
        InertialSample::check(samples)?;
        // Not `>=`: NaN is no time either.
        if !(interval_s[0] < interval_s[1] && interval_s[1] - interval_s[0] < f64::INFINITY) {
            return Err(Error::NotAscending { what: "end of the interval", index: 1 });
        }
        if !biases.to_vector().iter().all(|value| value.abs() < 1e6) {
            return Err(Error::NonFinite { what: "bias", index: 0 });
        }
        let samples = InertialSample::within(samples, interval_s, noise.max_gap_s)?;
        Ok(Self::summed(samples, biases, noise))
    }

    /// The same interval at other biases, exactly: where these are so far from the reference that first order is not enough.
    #[must_use]
    pub fn reintegrated(&self, biases: &Biases) -> Self {
        Self::summed(self.samples.clone(), biases, &self.noise)
    }

    /// The same interval with the noise that the unit has.
    #[cfg(feature = "sequence")]
    pub(crate) fn with_noise(&self, noise: &ImuNoise) -> Self {
        Self::summed(self.samples.clone(), &self.biases, noise)
    }

    /// Intervals that follow each other as one, at the biases of the first.
    #[cfg(feature = "sequence")]
    pub(crate) fn joined(parts: &[Self]) -> Self {
        let inside = |(index, part): (usize, &Self)| part.samples[usize::from(index > 0)..].to_vec();
        let samples = parts.iter().enumerate().flat_map(inside).collect();
        Self::summed(samples, &parts[0].biases, &parts[0].noise)
    }

    fn summed(samples: Vec<InertialSample>, biases: &Biases, noise: &ImuNoise) -> Self {
        let mut motion =
            Motion { rotation: UnitQuaternion::identity(), velocity: Vector3::zeros(), position: Vector3::zeros() };
        let (mut covariance, mut by_biases) = (Matrix9::zeros(), Matrix9x6::zeros());
        for pair in samples.windows(2) {
            let step = step(&motion, &pair[0], &pair[1], biases, noise);
            covariance = step.by_motion * covariance * step.by_motion.transpose() + step.noise;
            by_biases = step.by_motion * by_biases + step.by_biases;
            motion = step.motion;
        }
        let seconds =
            samples.last().zip(samples.first()).map_or(0.0, |(last, first)| last.timestamp_s - first.timestamp_s);
        let Motion { rotation, velocity, position } = motion;
        let covariance = (covariance + covariance.transpose()) * 0.5;
        Self { seconds, rotation, velocity, position, covariance, by_biases, biases: *biases, samples, noise: *noise }
    }

    /// How far the unit turned as it measures, all turns summed up, radian.
    #[cfg(feature = "sequence")]
    pub(crate) fn measured_angle(&self) -> f64 {
        let turn = |pair: &[InertialSample]| {
            let rate = (pair[0].angular_rate + pair[1].angular_rate) * 0.5;
            rate.norm() * (pair[1].timestamp_s - pair[0].timestamp_s)
        };
        self.samples.windows(2).map(turn).sum()
    }

    /// ΔR, Δv and Δp at other biases, to first order.
    pub(crate) fn corrected(&self, biases: &Biases) -> Motion {
        let change: Vector6<f64> = biases.to_vector() - self.biases.to_vector();
        let effect = self.by_biases * change;
        let part = |at: usize| effect.fixed_rows::<3>(at).into_owned();
        Motion {
            rotation: self.rotation * UnitQuaternion::from_scaled_axis(part(ROTATION)),
            velocity: self.velocity + part(VELOCITY),
            position: self.position + part(POSITION),
        }
    }
}
