//! Reference ranges to a known plane (Eq. 17).

use camera_model::Camera;
use nalgebra::{Isometry3, Point3, Unit, Vector3};

use crate::{Error, Result};

/// A plane in object space: the points `r` with `nᵀ r = d`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    normal: Unit<Vector3<f64>>,
    distance_m: f64,
}

impl Plane {
    /// The plane with this normal (of any length but zero) through this point.
    pub fn new(normal: &Vector3<f64>, point: &Point3<f64>) -> Result<Self> {
        let normal = Unit::try_new(*normal, f64::MIN_POSITIVE).ok_or(Error::OutOfDomain {
            name: "length of the plane's normal",
            value: normal.norm(),
            expected: "a direction",
        })?;
        let distance_m = normal.dot(&point.coords);
        if distance_m.is_finite() {
            return Ok(Self { normal, distance_m });
        }
        Err(Error::OutOfDomain { name: "distance of the plane", value: distance_m, expected: "a finite distance" })
    }

    /// The plane that a camera at the origin, looking along -z, sees straight on at this distance: the laboratory
    /// method, with the camera's pose the identity.
    pub fn facing_camera(distance_m: f64) -> Result<Self> {
        if !distance_m.is_finite() || distance_m <= 0.0 {
            return Err(Error::OutOfDomain {
                name: "distance_m",
                value: distance_m,
                expected: "a plane in front of the camera has a positive distance",
            });
        }
        Self::new(&-Vector3::z(), &Point3::new(0.0, 0.0, -distance_m))
    }

    /// The same plane seen from another frame.
    pub fn moved(&self, to_from_here: &Isometry3<f64>) -> Result<Self> {
        let foot = Point3::from(self.normal() * self.distance_m);
        Self::new(&(to_from_here * self.normal()), &(to_from_here * foot))
    }

    /// Unit normal n.
    pub fn normal(&self) -> Vector3<f64> {
        self.normal.into_inner()
    }

    /// Distance parameter d, metre.
    pub fn distance_m(&self) -> f64 {
        self.distance_m
    }

    /// Reference range of a pixel `(col, row)`, metre, and the cosine of the angle of incidence:
    /// `ρ_ref = (d − nᵀ r_c) / (nᵀ Rᵀ p) · |p|` (Eq. 17), `p` being the corrected image point.
    pub fn reference_range(
        &self,
        camera: &Camera,
        world_from_camera: &Isometry3<f64>,
        pixel: [f64; 2],
    ) -> Result<(f64, f64)> {
        let ray = world_from_camera.rotation * camera.ray(pixel);
        let slope = self.normal.dot(&ray);
        let range_m = (self.distance_m - self.normal.dot(&world_from_camera.translation.vector)) / slope;
        if range_m > 0.0 && range_m.is_finite() {
            Ok((range_m, slope.abs()))
        } else {
            Err(Error::PlaneNotSeen { col: pixel[0], row: pixel[1] })
        }
    }
}
