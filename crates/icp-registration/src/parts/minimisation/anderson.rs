//! Acceleration of the sequence of poses.

use std::collections::VecDeque;

use nalgebra::{DMatrix, DVector, Isometry3, Vector3, Vector6};

use crate::error::{Error, Result};
use crate::pose::move_about;

/// Anderson acceleration `[Pavlov2018]`: the next pose is the mixture of the last ones that would have left the smallest
/// step, had the steps been linear. Guarded as in `[Zhang2021]`: where the pairs fit worse at the mixture than before, the
/// plain step is taken instead and the history forgotten.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AndersonAcceleration {
    /// Poses that are mixed. Default 4.
    pub memory: usize,
}

impl Default for AndersonAcceleration {
    fn default() -> Self {
        Self { memory: 4 }
    }
}

impl AndersonAcceleration {
    pub(crate) fn validate(self) -> Result<()> {
        if (1..=12).contains(&self.memory) {
            return Ok(());
        }
        Err(Error::InvalidOption { name: "memory", value: self.memory as f64, domain: "1 to 12" })
    }
}

/// The history of one level; poses as motions `[dt, rho w]` of the first pose about its centre.
pub(crate) struct Accelerator {
    memory: usize,
    origin: Isometry3<f64>,
    centre: Vector3<f64>,
    radius_m: f64,
    /// Pose after the plain step, and the step that led there.
    history: VecDeque<(Vector6<f64>, Vector6<f64>)>,
    /// What to return to, and how well the pairs fitted, if the last pose was a mixture.
    guarded: Option<(Isometry3<f64>, f64)>,
}

impl Accelerator {
    pub(crate) fn new(
        options: AndersonAcceleration,
        origin: Isometry3<f64>,
        centre: Vector3<f64>,
        radius_m: f64,
    ) -> Self {
        Self { memory: options.memory, origin, centre, radius_m, history: VecDeque::new(), guarded: None }
    }

    /// The pose to return to where the last mixture fits worse (energy: smaller is better) than the pose before it.
    pub(crate) fn refused(&mut self, energy: f64) -> Option<Isometry3<f64>> {
        let (plain, before) = self.guarded.take()?;
        if energy <= before {
            return None;
        }
        self.history.clear();
        Some(plain)
    }

    /// The pose to go on from, after the plain step from `from` (where the pairs fitted with `energy`) to `plain`.
    pub(crate) fn next(&mut self, from: &Isometry3<f64>, plain: Isometry3<f64>, energy: f64) -> Isometry3<f64> {
        let (u, g) = (self.coordinates(from), self.coordinates(&plain));
        self.history.push_front((g, g - u));
        self.history.truncate(self.memory + 1);
        let Some(mixed) = self.mixture().filter(|m| m.iter().all(|v| v.is_finite())) else { return plain };
        // A mixture far beyond the plain step is an extrapolation of noise.
        if (mixed - g).norm() > 10.0 * (g - u).norm() {
            return plain;
        }
        self.guarded = Some((plain, energy));
        move_about(&self.origin, &self.centre, self.radius_m, &mixed)
    }

    /// `Σ α g` with `Σ α = 1` and least `|Σ α f|`.
    fn mixture(&self) -> Option<Vector6<f64>> {
        let others = self.history.len() - 1;
        if others == 0 {
            return None;
        }
        let (g0, f0) = self.history[0];
        let differences = DMatrix::from_fn(6, others, |row, k| (self.history[k + 1].1 - f0)[row]);
        let scale = differences.norm().max(f64::MIN_POSITIVE);
        let svd = (differences / scale).svd(true, true);
        let right = DVector::from_fn(6, |row, _| -f0[row] / scale);
        let alpha = svd.solve(&right, 1e-8).ok()?;
        Some((0..others).fold(g0, |sum, k| sum + (self.history[k + 1].0 - g0) * alpha[k]))
    }

    fn coordinates(&self, pose: &Isometry3<f64>) -> Vector6<f64> {
        let turn = (pose.rotation * self.origin.rotation.inverse()).scaled_axis();
        let rotated = self.centre
            + pose.rotation * self.origin.rotation.inverse() * (self.origin.translation.vector - self.centre);
        let dt = pose.translation.vector - rotated;
        let w = turn * self.radius_m;
        Vector6::new(dt.x, dt.y, dt.z, w.x, w.y, w.z)
    }
}
