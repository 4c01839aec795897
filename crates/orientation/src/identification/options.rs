//! What is named, how, and what comes out.

use nalgebra::Isometry3;

/// A target that was seen, and whose name is not known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnnamedTarget {
    /// Observed pixel position `(col, row)`, lens distortion included.
    pub pixel: [f64; 2],
    /// Distance from the perspective centre, metre, if there is one. It may have errors of some centimetres.
    pub range_m: Option<f64>,
}

/// How targets are told by their arrangement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IdentificationOptions {
    /// Largest expected number of arrangements that fit as well by chance. Default: 0.001.
    pub level: f64,
    /// Approximate pose `world_from_camera`, which decides between arrangements that fit alike. Default: `None`.
    pub approximate: Option<Isometry3<f64>>,
}

impl Default for IdentificationOptions {
    fn default() -> Self {
        Self { level: 1e-3, approximate: None }
    }
}

/// Targets with their names.
#[derive(Debug, Clone, PartialEq)]
pub struct Identification {
    /// `[seen, known]`: which point that was seen is which target, by the first. Points without a target are missing.
    pub pairs: Vec<[usize; 2]>,
    /// Pose that they were named at, a start value.
    pub world_from_camera: Isometry3<f64>,
    /// How many arrangements would fit as well by chance.
    pub expected_by_chance: f64,
}
