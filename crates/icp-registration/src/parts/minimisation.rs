//! How the weighted squares of the residuals are made small.

use nalgebra::{Matrix6, Point3, Vector6};
use rigid_pose::{Centred, RotationMethod, absolute_orientation_by};

use super::ErrorMetric;
use crate::error::{Error, Result};
use crate::system::System;

/// Finds a motion for fixed pairs.
pub trait Minimiser: Sync {
    /// The motion `[dt, rho w]` in [`System::frame`] (about its centre in target axes, rotation vector times its radius: all
    /// six in metre) that makes the sum of squares of the system smaller, among those that are `free` (a projection).
    fn step(&self, system: &System<'_>, free: &Matrix6<f64>) -> Result<Vector6<f64>>;

    /// Refuses metrics that it cannot minimise.
    fn validate(&self, _metric: &dyn ErrorMetric) -> Result<()> {
        Ok(())
    }
}

/// One solution of the 6x6 normal equations, with weights as they are: no step along motions without information.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct GaussNewton;

impl Minimiser for GaussNewton {
    fn step(&self, system: &System<'_>, free: &Matrix6<f64>) -> Result<Vector6<f64>> {
        Ok(system.normal_equations().step(free, 0.0)?)
    }
}

/// Closed-form absolute orientation `[Eggert1997]` of the weighted pairs; for the point-to-point metric only.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ClosedForm(pub RotationMethod);

impl Minimiser for ClosedForm {
    fn step(&self, system: &System<'_>, free: &Matrix6<f64>) -> Result<Vector6<f64>> {
        // About the centre and in units of the radius: independent of where the clouds are and how large.
        let Centred { centre, radius_m: radius } = system.frame();
        let reduced = |v: &nalgebra::Vector3<f64>| Point3::from((v - centre) / radius);
        let source: Vec<_> = system.pairs().iter().map(|p| reduced(&p.moved)).collect();
        let target: Vec<_> = system.pairs().iter().map(|p| reduced(&p.point)).collect();
        let weights = system.all_weights();
        let largest = weights.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let relative: Vec<f64> = weights.iter().map(|w| w / largest).collect();
        let motion = absolute_orientation_by(self.0, &source, &target, Some(&relative))?.target_from_source;
        let (dt, w) = (motion.translation.vector * radius, motion.rotation.scaled_axis() * radius);
        Ok(free * Vector6::new(dt.x, dt.y, dt.z, w.x, w.y, w.z))
    }

    fn validate(&self, metric: &dyn ErrorMetric) -> Result<()> {
        if metric.is_point_to_point() {
            return Ok(());
        }
        Err(Error::Incompatible { what: "a closed form", with: "a metric other than point to point" })
    }
}
