//! A cloud with what is known of its points' errors.

use nalgebra::Point3;
use point_uncertainty::{CommonErrors, PointErrors};

/// Points in world axes with their errors.
#[derive(Clone, Copy)]
pub struct Cloud<'a> {
    /// The points, metre.
    pub points: &'a [Point3<f64>],
    /// What each point has for itself, and how it moves with the common errors.
    pub errors: &'a dyn PointErrors,
    /// Covariance of what many points have in common.
    pub common: &'a CommonErrors,
}
