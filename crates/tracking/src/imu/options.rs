//! What an inertial unit delivers, and what is known of its errors.

use nalgebra::Isometry3;

use crate::error::{Error, Result};

/// Noise and mounting of an inertial unit. The defaults are those of a small unit of a phone.
#[derive(Debug, Clone, PartialEq)]
pub struct ImuOptions {
    /// Pose of the body (the axes of the inertial unit) in the camera's frame. Default: the identity.
    pub camera_from_body: Isometry3<f64>,
    /// Noise density of the rates, rad/s/√Hz. Default 2e-4.
    pub gyro_noise: f64,
    /// Noise density of the specific forces, m/s²/√Hz. Default 2e-3.
    pub accel_noise: f64,
    /// Random walk of the rates' bias, rad/s²/√Hz. Default 2e-5.
    pub gyro_walk: f64,
    /// Random walk of the forces' bias, m/s³/√Hz. Default 2e-4.
    pub accel_walk: f64,
    /// Standard deviation of the forces' bias at switching on, m/s². Default 0.1.
    pub accel_bias_sigma: f64,
    /// Gravity, m/s². Default 9.80665.
    pub gravity_m_s2: f64,
    /// Longest time without a sample, second. Default 0.05.
    pub max_gap_s: f64,
    /// Largest standard deviation of the rates of a body that counts as resting, rad/s. Default 0.05.
    pub rest_rate: f64,
    /// Largest standard deviation of its specific forces, m/s². Default 0.5.
    pub rest_force: f64,
}

impl Default for ImuOptions {
    fn default() -> Self {
        Self {
            camera_from_body: Isometry3::identity(),
            gyro_noise: 2e-4,
            accel_noise: 2e-3,
            gyro_walk: 2e-5,
            accel_walk: 2e-4,
            accel_bias_sigma: 0.1,
            gravity_m_s2: 9.80665,
            max_gap_s: 0.05,
            rest_rate: 0.05,
            rest_force: 0.5,
        }
    }
}

impl ImuOptions {
    pub(super) fn validate(&self) -> Result<()> {
        if !rigid_pose::is_finite(&self.camera_from_body) {
            return Err(Error::NonFinite { what: "camera_from_body", index: 0 });
        }
        let figures = [
            ("gyro_noise", self.gyro_noise),
            ("accel_noise", self.accel_noise),
            ("gyro_walk", self.gyro_walk),
            ("accel_walk", self.accel_walk),
            ("accel_bias_sigma", self.accel_bias_sigma),
            ("gravity_m_s2", self.gravity_m_s2),
            ("max_gap_s", self.max_gap_s),
            ("rest_rate", self.rest_rate),
            ("rest_force", self.rest_force),
        ];
        for (name, value) in figures {
            if !(value > 0.0 && value < 1e6) {
                return Err(Error::InvalidOption { name, value, domain: "positive and below 1e6" });
            }
        }
        Ok(())
    }
}
