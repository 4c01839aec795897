//! A unit at rest: its rates are their bias, its forces gravity.

use nalgebra::Vector3;

use crate::noise::ImuNoise;
use crate::sample::InertialSample;

/// Shortest rest, second: the noise of forces then leaves 3 mm/s² of gravity, less than their bias does.
const SHORTEST_S: f64 = 0.5;
/// Length of gravity on earth, m/s², and what a unit's bias and scale may make of it: five deviations of a phone's bias.
pub(crate) const GRAVITY_M_S2: f64 = 9.80665;
const GRAVITY_WITHIN: f64 = 1.0;
/// Standard deviations of a bias that the mean rate may reach.
const BIAS_SIGMAS: f64 = 5.0;
/// Times the spread of the noise that samples at rest may have: a spectrum that is not flat, and a floor that shakes.
const MOST_SPREAD: f64 = 10.0;

/// What a unit at rest shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rest {
    /// Mean rate, which is the bias, rad/s.
    pub rate: Vector3<f64>,
    /// Mean specific force: gravity, upwards, and the bias, m/s².
    pub force: Vector3<f64>,
    /// How long it rested, second.
    pub seconds: f64,
}

impl Rest {
    /// Variance of each component of the mean rate as the bias at the end of the rest: noise, and what the bias walked, (rad/s)².
    pub fn rate_variance(&self, noise: &ImuNoise) -> f64 {
        noise.gyro_density.powi(2) / self.seconds + noise.gyro_walk.powi(2) * self.seconds / 3.0
    }
}

/// Why samples are not those of a unit at rest.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Unrest {
    /// Too few samples.
    #[error(
        "the unit has {seconds:.2} s of samples, and at least {SHORTEST_S} s at rest are needed to find its bias and gravity"
    )]
    TooShort {
        /// How long they are, second.
        seconds: f64,
    },
    /// Forces whose mean is not gravity.
    #[error("the unit's forces have a mean of {mean_m_s2:.3} m/s²{}", unit_of(*mean_m_s2))]
    Force {
        /// Length of the mean, m/s².
        mean_m_s2: f64,
    },
    /// Rates whose mean is no bias.
    #[error("the unit turns by {mean_rad_s:.3} rad/s: it does not rest, or rates are in degrees a second")]
    Rate {
        /// Length of the mean, rad/s.
        mean_rad_s: f64,
    },
    /// Samples that scatter.
    #[error(
        "the unit does not rest: its rates scatter by {rates_rad_s:.4} rad/s, its forces by {forces_m_s2:.3} m/s² (at rest up to \
         {:.4} and {:.3})", most[0], most[1]
    )]
    Scatter {
        /// Standard deviation of the rates, rad/s.
        rates_rad_s: f64,
        /// Standard deviation of the forces, m/s².
        forces_m_s2: f64,
        /// What both may be.
        most: [f64; 2],
    },
}

/// What a mean force says of its unit.
fn unit_of(mean_m_s2: f64) -> &'static str {
    if (mean_m_s2 - 1.0).abs() < GRAVITY_WITHIN / GRAVITY_M_S2 {
        ": they are in units of gravity, expected m/s²"
    } else if mean_m_s2 < GRAVITY_WITHIN {
        ": gravity was taken off, expected specific forces as they are measured"
    } else {
        ": it does not rest, or forces are in another unit than m/s²"
    }
}

/// Means of samples of a unit that rests.
///
/// # Errors
/// [`Unrest`], where they are too short, scatter by more than ten times the noise, or have means that are neither bias nor gravity.
pub fn rest(samples: &[InertialSample], noise: &ImuNoise) -> Result<Rest, Unrest> {
    let seconds = samples.first().zip(samples.last()).map_or(0.0, |(first, last)| last.timestamp_s - first.timestamp_s);
    if seconds.is_nan() || seconds < SHORTEST_S {
        return Err(Unrest::TooShort { seconds });
    }
    let count = samples.len() as f64;
    let mean = |of: fn(&InertialSample) -> Vector3<f64>| samples.iter().map(of).sum::<Vector3<f64>>() / count;
    let (rate, force) = (mean(|sample| sample.angular_rate), mean(|sample| sample.specific_force));
    if !force.norm().is_finite() || (force.norm() - GRAVITY_M_S2).abs() > GRAVITY_WITHIN {
        return Err(Unrest::Force { mean_m_s2: force.norm() });
    }
    if !rate.norm().is_finite() || rate.norm() > BIAS_SIGMAS * noise.gyro_bias_sigma {
        return Err(Unrest::Rate { mean_rad_s: rate.norm() });
    }
    // The spread of samples at a rate is the density times the root of the rate.
    let spacing_s = seconds / (count - 1.0).max(1.0);
    let spread = |of: &dyn Fn(&InertialSample) -> f64| {
        (samples.iter().map(|sample| of(sample).powi(2)).sum::<f64>() / (3.0 * count)).sqrt()
    };
    let rates_rad_s = spread(&|sample| (sample.angular_rate - rate).norm());
    let forces_m_s2 = spread(&|sample| (sample.specific_force - force).norm());
    let most = [noise.gyro_density, noise.accel_density].map(|density| MOST_SPREAD * density / spacing_s.sqrt());
    if rates_rad_s > most[0] || forces_m_s2 > most[1] {
        return Err(Unrest::Scatter { rates_rad_s, forces_m_s2, most });
    }
    Ok(Rest { rate, force, seconds })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn resting(count: i32, step_s: f64) -> Vec<InertialSample> {
        let sample = |k: i32| InertialSample {
            timestamp_s: f64::from(k) * step_s,
            angular_rate: Vector3::new(0.01, 0.0, -0.02 + 1e-3 * f64::from(k % 3 - 1)),
            specific_force: Vector3::new(0.1, 9.8, 0.01 * f64::from(k % 3 - 1)),
        };
        (0..count).map(sample).collect()
    }

    #[test]
    fn means_of_a_rest_are_bias_and_gravity() {
        let found = rest(&resting(301, 0.005), &ImuNoise::default());
        let close = |found: Rest| (found.rate - Vector3::new(0.01, 0.0, -0.02)).norm() < 1e-5 && found.force.y > 9.7;
        assert!(found.is_ok_and(close), "{found:?}");
    }

    #[test]
    fn what_is_no_rest_says_why() {
        let noise = ImuNoise::default();
        let with = |change: fn(&mut InertialSample)| {
            let mut samples = resting(301, 0.005);
            samples.iter_mut().for_each(change);
            rest(&samples, &noise).map_err(|error| error.to_string())
        };
        assert!(matches!(rest(&resting(50, 0.005), &noise), Err(Unrest::TooShort { .. })));
        assert!(matches!(rest(&[], &noise), Err(Unrest::TooShort { .. })));
        for (change, words) in [
            ((|sample| sample.specific_force /= 9.80665) as fn(&mut InertialSample), "units of gravity"),
            (|sample| sample.specific_force = Vector3::zeros(), "taken off"),
            (|sample| sample.specific_force.x = f64::NAN, "does not rest"),
            (|sample| sample.angular_rate *= 57.3, "degrees"),
            (|sample| sample.angular_rate.x = 0.3 * (20.0 * sample.timestamp_s).sin(), "scatter"),
        ] {
            assert!(with(change).is_err_and(|error| error.contains(words)), "{words}");
        }
    }
}
