use nalgebra::{Vector3, Vector6};

use crate::{Error, Result};

/// Biases of an inertial unit: what is to be taken off its samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Biases {
    /// Of the angular rates, rad/s.
    pub gyro: Vector3<f64>,
    /// Of the specific forces, m/s².
    pub accel: Vector3<f64>,
}

impl Biases {
    /// None.
    #[must_use]
    pub fn zero() -> Self {
        Self { gyro: Vector3::zeros(), accel: Vector3::zeros() }
    }

    /// `[gyro, accel]`.
    #[must_use]
    pub fn to_vector(&self) -> Vector6<f64> {
        let (g, a) = (self.gyro, self.accel);
        Vector6::new(g.x, g.y, g.z, a.x, a.y, a.z)
    }

    /// Of `[gyro, accel]`.
    #[must_use]
    pub fn from_vector(vector: &Vector6<f64>) -> Self {
        Self { gyro: vector.fixed_rows::<3>(0).into_owned(), accel: vector.fixed_rows::<3>(3).into_owned() }
    }
}

/// Noise of an inertial unit. The defaults are those of a small unit of a phone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImuNoise {
    /// Noise density of the rates, rad/s/√Hz. Default 2e-4.
    pub gyro_density: f64,
    /// Noise density of the specific forces, m/s²/√Hz. Default 2e-3.
    pub accel_density: f64,
    /// Random walk of the rates' bias, rad/s²/√Hz. Default 2e-5.
    pub gyro_walk: f64,
    /// Random walk of the forces' bias, m/s³/√Hz. Default 2e-4.
    pub accel_walk: f64,
    /// Standard deviation of the rates' bias at switching on, rad/s. Default 0.02.
    pub gyro_bias_sigma: f64,
    /// Standard deviation of the forces' bias at switching on, m/s². Default 0.2.
    pub accel_bias_sigma: f64,
    /// Longest time without a sample, second. Default 0.05.
    pub max_gap_s: f64,
}

impl Default for ImuNoise {
    fn default() -> Self {
        Self {
            gyro_density: 2e-4,
            accel_density: 2e-3,
            gyro_walk: 2e-5,
            accel_walk: 2e-4,
            gyro_bias_sigma: 0.02,
            accel_bias_sigma: 0.2,
            max_gap_s: 0.05,
        }
    }
}

impl ImuNoise {
    pub(crate) fn check(&self) -> Result<()> {
        let figures = [
            ("gyro_density", self.gyro_density),
            ("accel_density", self.accel_density),
            ("gyro_walk", self.gyro_walk),
            ("accel_walk", self.accel_walk),
            ("gyro_bias_sigma", self.gyro_bias_sigma),
            ("accel_bias_sigma", self.accel_bias_sigma),
            ("max_gap_s", self.max_gap_s),
        ];
        for (name, value) in figures {
            // Below 1e-12 a covariance of its square is not told from zero by a factorisation.
            if !(value > 1e-12 && value < 1e6) {
                return Err(Error::InvalidOption { name, value, expected: "a number above 1e-12 and below 1e6" });
            }
        }
        Ok(())
    }
}
