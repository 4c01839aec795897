//! Primitives as their users know them.

use std::fmt;

use nalgebra::{Point3, Vector3};

/// Which primitive a region shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PrimitiveKind {
    /// A plane.
    Plane,
    /// A sphere, seen from outside or from within.
    Sphere,
    /// A circular cylinder, seen from outside or from within.
    Cylinder,
}

/// A primitive in the camera frame, metre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Primitive {
    /// The points `r` with `nᵀ r = d`.
    Plane {
        /// Unit normal n, away from the camera.
        normal: Vector3<f64>,
        /// d, positive.
        distance_m: f64,
    },
    /// A sphere.
    Sphere {
        /// Its centre.
        centre: Point3<f64>,
        /// Its radius.
        radius_m: f64,
    },
    /// A cylinder without ends.
    Cylinder {
        /// A point on its axis, beside the middle of the region.
        point: Point3<f64>,
        /// Unit direction of its axis.
        axis: Vector3<f64>,
        /// Its radius.
        radius_m: f64,
    },
}

impl PrimitiveKind {
    /// Number of parameters.
    pub fn parameters(self) -> usize {
        match self {
            Self::Plane => 3,
            Self::Sphere => 4,
            Self::Cylinder => 5,
        }
    }
}

impl fmt::Display for PrimitiveKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Plane => "plane",
            Self::Sphere => "sphere",
            Self::Cylinder => "cylinder",
        })
    }
}
