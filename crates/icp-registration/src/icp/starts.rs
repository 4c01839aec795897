//! More starts around the guess, for when the first does not convince.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rigid_pose::{require_count, require_option};

use crate::error::Result;

/// The positive root of x⁷ = x + 1: its powers spread points evenly over six dimensions.
const ROOT_OF_SIX: f64 = 1.112_775_684_278_705_5;

/// Starts around the guess, tried when too few points fit after the way down from the guess itself, and nothing is said
/// about how far off it is ([`super::Levels::first_limit_m`]).
///
/// Two clouds that share half of what they see have many poses at which walls fall on walls; no single way down finds the
/// right one from tens of degrees off. Each start goes down with few points, and the best are brought down with more.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Starts {
    /// Number of starts besides the guess. Default 24.
    pub count: usize,
    /// Farthest translation of a start along each axis, in units of the first distance limit. Default 0.8.
    pub translation: f64,
    /// Farthest rotation of a start about each axis, radian. Default 0.35 (20 degrees).
    pub rotation_rad: f64,
    /// Source points that a start goes down with. Default 500.
    pub points: usize,
    /// Starts that are brought down with more points. Default 4.
    pub refined: usize,
    /// Share of the points that must have a partner for the guess to convince. Default 0.45.
    pub convincing: f64,
}

impl Default for Starts {
    fn default() -> Self {
        Self { count: 24, translation: 0.8, rotation_rad: 0.35, points: 500, refined: 4, convincing: 0.45 }
    }
}

impl Starts {
    /// The starts: an evenly spread sequence `[Roberts2018]` about the guess, turned about `centre` (target frame).
    pub(super) fn around(
        &self,
        guess: &Isometry3<f64>,
        centre: &Vector3<f64>,
        first_limit_m: f64,
    ) -> Vec<Isometry3<f64>> {
        let start = |k: usize| {
            let along = |axis: i32| {
                let position = (0.5 + (k + 1) as f64 * ROOT_OF_SIX.powi(-1 - axis)).fract();
                2.0 * position - 1.0
            };
            let slide = Vector3::new(along(0), along(1), along(2)) * (self.translation * first_limit_m);
            let turn = UnitQuaternion::from_scaled_axis(Vector3::new(along(3), along(4), along(5)) * self.rotation_rad);
            let translation = centre + slide + turn * (guess.translation.vector - centre);
            Isometry3::from_parts(translation.into(), turn * guess.rotation)
        };
        (0..self.count).map(start).collect()
    }

    pub(super) fn validate(&self) -> Result<()> {
        let shares =
            [("translation", self.translation), ("rotation_rad", self.rotation_rad), ("convincing", self.convincing)];
        for (name, value) in shares {
            require_option(name, value, "0 or more and finite", |value| value >= 0.0 && value.is_finite())?;
        }
        Ok(require_count("points", self.points, 1)?)
    }
}
