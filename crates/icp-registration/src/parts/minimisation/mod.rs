//! How the weighted squares of the residuals are made small.

mod closed_form;
mod gauss_newton;
mod levenberg_marquardt;

pub use closed_form::ClosedForm;
pub use gauss_newton::GaussNewton;
pub use levenberg_marquardt::LevenbergMarquardt;

use nalgebra::Vector6;

use crate::error::Result;
use crate::parts::scene::Scene;
use crate::system::System;

/// Finds a motion for fixed pairs.
pub trait Minimiser: Sync {
    /// The motion `[dt, rho w]` in [`System::frame`] (about its centre in target axes, rotation vector times its radius: all
    /// six in metre) that makes the sum of squares of the system smaller, without a part along the orthonormal `held`.
    fn step(&self, system: &System<'_>, held: &[Vector6<f64>]) -> Result<Vector6<f64>>;

    /// Refuses parameters outside their domain, and metrics that it cannot minimise.
    fn validate(&self, _scene: &Scene<'_>, _metric: &dyn super::ErrorMetric) -> Result<()> {
        Ok(())
    }
}
