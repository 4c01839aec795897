use range_image::ImageFormat;

use crate::{Error, Result};

/// Principal point and principal distance (the interior orientation), millimetre.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct InteriorOrientation {
    /// Principal point `(xp, yp)` in image coordinates.
    pub principal_point_mm: [f64; 2],
    /// Principal distance `c`.
    pub principal_distance_mm: f64,
}

/// Radial and decentring lens distortion (Eqs. 8-13), affinity and shear `[Fraser1997]`, all functions of the
/// **observed** image point.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
pub struct LensDistortion {
    /// Radial, mm^-2.
    pub k1: f64,
    /// Radial, mm^-4.
    pub k2: f64,
    /// Radial, mm^-6.
    pub k3: f64,
    /// Decentring, mm^-1.
    pub p1: f64,
    /// Decentring, mm^-1.
    pub p2: f64,
    /// Affinity, no unit: `dx = b1 xb`, a scale along x that differs from that along y.
    pub b1: f64,
    /// Shear, no unit: `dx = b2 yb`, axes that are not at right angles.
    pub b2: f64,
}

/// The geometric model of one camera: image format, interior orientation, lens.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Camera {
    /// Size of the image and its pixels.
    pub format: ImageFormat,
    /// Principal point and distance.
    pub interior: InteriorOrientation,
    /// Lens distortion; all zero for a pinhole.
    #[cfg_attr(feature = "serde", serde(default))]
    pub lens: LensDistortion,
}

impl Camera {
    /// A camera with checked parameters.
    pub fn new(format: ImageFormat, interior: InteriorOrientation, lens: LensDistortion) -> Result<Self> {
        let camera = Self { format, interior, lens };
        camera.validate()?;
        Ok(camera)
    }

    /// Checks what a value read from a file may get wrong: finite parameters, positive principal distance.
    pub fn validate(&self) -> Result<()> {
        self.format.validate()?;
        let c = self.interior.principal_distance_mm;
        if !(c.is_finite() && c > 0.0) {
            return Err(Error::OutOfDomain {
                name: "principal_distance_mm",
                value: c,
                expected: "a principal distance is positive and finite",
            });
        }
        let [xp, yp] = self.interior.principal_point_mm;
        let lens = self.lens;
        for (name, value) in [
            ("xp", xp),
            ("yp", yp),
            ("k1", lens.k1),
            ("k2", lens.k2),
            ("k3", lens.k3),
            ("p1", lens.p1),
            ("p2", lens.p2),
            ("b1", lens.b1),
            ("b2", lens.b2),
        ] {
            if !value.is_finite() {
                return Err(Error::OutOfDomain { name, value, expected: "a camera parameter is finite" });
            }
        }
        Ok(())
    }
}
