//! A cloud of points with what is known of each.

use nalgebra::{Isometry3, Point3, Vector3};
use rigid_pose::{InputError, is_usable, require_length, require_points};
use statistics::upper_median;

use crate::error::{Error, Result};

/// Points at the origin that a cloud may hold by chance, and the share of them.
const MOST_AT_ORIGIN: usize = 100;
const LARGEST_SHARE_AT_ORIGIN: f64 = 0.01;

/// Points in one frame, metre.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cloud {
    /// The points; all finite.
    pub points: Vec<Point3<f64>>,
    /// Unit normals, one a point; NaN in all components where a point has none.
    pub normals: Option<Vec<Vector3<f64>>>,
    /// Standard deviation of each point, along its ray where it was seen along one, metre; NaN where unknown.
    pub sigma: Option<Vec<f64>>,
    /// Amplitude or intensity of each point in any unit; NaN where unknown.
    pub intensity: Option<Vec<f64>>,
    /// Whether a point lies at the rim of what was seen or is suspected to mix two surfaces; partners there mislead.
    pub rim: Option<Vec<bool>>,
}

impl Cloud {
    /// A cloud of bare points.
    pub fn new(points: Vec<Point3<f64>>) -> Self {
        Self { points, ..Self::default() }
    }

    /// A cloud from the pixels of a frame, in the camera's frame: those whose point is not finite, or lies in the camera (as
    /// zeros written for no range), are left out, together with their normal and sigma.
    ///
    /// # Errors
    /// [`InputError::LengthMismatch`] where the planes differ in length.
    pub fn from_frame(points: &[[f64; 3]], normals: Option<&[Vector3<f64>]>, sigma: Option<&[f32]>) -> Result<Self> {
        require_length("normals", points.len(), normals.map(<[_]>::len))?;
        require_length("sigma", points.len(), sigma.map(<[_]>::len))?;
        let keep: Vec<usize> = (0..points.len())
            .filter(|&i| is_usable(&Point3::from(points[i])) && points[i].iter().any(|c| c.abs() > 0.0))
            .collect();
        Ok(Self {
            points: keep.iter().map(|&i| Point3::from(points[i])).collect(),
            normals: normals.map(|n| keep.iter().map(|&i| n[i]).collect()),
            sigma: sigma.map(|s| keep.iter().map(|&i| f64::from(s[i])).collect()),
            ..Self::default()
        })
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// The cloud in another frame.
    #[must_use]
    pub fn transformed(&self, a_from_b: &Isometry3<f64>) -> Self {
        Self {
            points: self.points.iter().map(|p| a_from_b * p).collect(),
            normals: self.normals.as_ref().map(|n| n.iter().map(|v| a_from_b * v).collect()),
            ..self.clone()
        }
    }

    /// Refuses an empty cloud, points that are not finite or, many of them, not measured, planes of another length and sigmas
    /// that are not positive (NaN passes: unknown). `what` names the cloud.
    ///
    /// # Errors
    /// [`InputError::Empty`], [`InputError::NonFinite`], [`Error::Unmeasured`], [`InputError::LengthMismatch`], [`InputError::NotPositive`].
    pub fn validate(&self, what: &'static str) -> Result<()> {
        if self.is_empty() {
            return Err(InputError::Empty { what }.into());
        }
        require_points(what, &self.points)?;
        let (found, of) = (self.points.iter().filter(|p| **p == Point3::origin()).count(), self.len());
        if found > MOST_AT_ORIGIN && found as f64 > LARGEST_SHARE_AT_ORIGIN * of as f64 {
            return Err(Error::Unmeasured { what, found, of });
        }
        let planes = [
            ("normals", self.normals.as_ref().map(Vec::len)),
            ("sigma", self.sigma.as_ref().map(Vec::len)),
            ("intensity", self.intensity.as_ref().map(Vec::len)),
            ("rim", self.rim.as_ref().map(Vec::len)),
        ];
        for (plane, found) in planes {
            require_length(plane, self.len(), found)?;
        }
        let Some(sigma) = &self.sigma else { return Ok(()) };
        match sigma.iter().position(|s| !(s.is_nan() || (*s > 0.0 && *s < 1e100))) {
            Some(index) => Err(InputError::NotPositive { what: "sigma", index, value: sigma[index] }.into()),
            None => Ok(()),
        }
    }
}

/// Medians of the coordinates and of the distances from there, metre, of about `samples` of the points: outliers do not move
/// them far. NaN without points.
pub fn middle_and_radius(points: &[Point3<f64>], samples: usize) -> (Vector3<f64>, f64) {
    let sample = || points.iter().step_by(points.len().div_ceil(samples).max(1));
    let middle = Vector3::from_fn(|k, _| upper_median(&mut sample().map(|p| p[k]).collect::<Vec<f64>>()));
    (middle, upper_median(&mut sample().map(|p| (p.coords - middle).norm()).collect::<Vec<f64>>()))
}
