use std::f64::consts::TAU;

use crate::{Error, Result};

/// Speed of light in vacuum, m/s.
pub const SPEED_OF_LIGHT: f64 = 299_792_458.0;

/// Modulation of the illumination at one frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Modulation {
    frequency_hz: f64,
    group_refractive_index: f64,
}

impl Modulation {
    /// Modulation at `frequency_hz` in vacuum (group refractive index 1).
    pub fn new(frequency_hz: f64) -> Result<Self> {
        Self::in_medium(frequency_hz, 1.0)
    }

    /// Modulation at `frequency_hz` in a medium of the given group refractive index (air: about 1.00027).
    pub fn in_medium(frequency_hz: f64, group_refractive_index: f64) -> Result<Self> {
        if !(frequency_hz.is_finite() && frequency_hz > 0.0) {
            return Err(Error::OutOfDomain {
                name: "frequency_hz",
                value: frequency_hz,
                expected: "a modulation frequency is positive and finite",
            });
        }
        if !(group_refractive_index.is_finite() && group_refractive_index >= 1.0) {
            return Err(Error::OutOfDomain {
                name: "group_refractive_index",
                value: group_refractive_index,
                expected: "a group refractive index is at least 1",
            });
        }
        Ok(Self { frequency_hz, group_refractive_index })
    }

    /// Modulation frequency in hertz.
    pub fn frequency_hz(&self) -> f64 {
        self.frequency_hz
    }

    /// Ambiguity interval `U = c / 2 f` in metres (Eq. 16).
    pub fn ambiguity_interval_m(&self) -> f64 {
        SPEED_OF_LIGHT / self.group_refractive_index / (2.0 * self.frequency_hz)
    }

    /// Range in metres that a phase in radians stands for: `phase * U / 2 pi`.
    pub fn range_from_phase(&self, phase_rad: f64) -> f64 {
        phase_rad * (self.ambiguity_interval_m() / TAU)
    }

    /// Phase in radians, not wrapped, of a range in metres.
    pub fn phase_from_range(&self, range_m: f64) -> f64 {
        range_m * (TAU / self.ambiguity_interval_m())
    }
}
