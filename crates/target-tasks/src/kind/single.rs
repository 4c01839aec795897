//! Targets that stand alone.

use std::fmt;

/// A kind of single target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SingleKind {
    /// Coded rings, whose discs have this diameter. Their names are their codes: `R017`.
    Rings {
        /// Diameter of the discs, metre.
        diameter_m: f64,
    },
    /// Discs, bright or dark.
    Discs,
    /// Spheres, seen by their ranges.
    Spheres {
        /// Their radius, metre; `None` where it is not known.
        radius_m: Option<f64>,
    },
    /// Points of light.
    Lights,
}

impl SingleKind {
    /// Several of them, in a sentence.
    pub(crate) fn noun(self) -> &'static str {
        match self {
            Self::Rings { .. } => "coded rings",
            Self::Discs => "discs",
            Self::Spheres { .. } => "spheres",
            Self::Lights => "lights",
        }
    }

    /// Name of the only one of its kind, where no coordinates name it.
    pub(crate) fn only(self) -> &'static str {
        match self {
            Self::Rings { .. } => "R",
            Self::Discs => "D1",
            Self::Spheres { .. } => "S1",
            Self::Lights => "L1",
        }
    }
}

impl fmt::Display for SingleKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Rings { diameter_m } => write!(f, "rings {diameter_m}"),
            Self::Spheres { radius_m: Some(radius) } => write!(f, "spheres {radius}"),
            other => f.write_str(if matches!(other, Self::Spheres { .. }) { "spheres" } else { other.noun() }),
        }
    }
}
