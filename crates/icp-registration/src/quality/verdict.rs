//! Covariance and verdict from the sums over cells.

use nalgebra::{Isometry3, Matrix6, Point3, Vector6};

use super::cells::Cells;
use super::directions::{Directions, SIGNIFICANCE};
use crate::error::Result;
use crate::quality::UndeterminedMotion;
use rigid_pose::{Centred, symmetrised};

/// Share of the largest information that rounding can imitate.
pub(crate) const ROUNDING: f64 = 1e-9;

/// The motions that steps may take.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Free {
    /// The frame that they are told in; `None`: that of the pairs, whatever these are.
    pub frame: Option<Centred>,
    /// Projection on them.
    pub projection: Matrix6<f64>,
}

impl Free {
    /// All motions.
    pub fn all() -> Self {
        Self { frame: None, projection: Matrix6::identity() }
    }
}

/// What pairs say about a pose.
pub(crate) struct Verdict {
    frame: Centred,
    directions: Directions,
}

impl Verdict {
    /// Judges the pairs; motions with a predicted sigma above `max_sigma_m` are undetermined.
    pub fn new(cells: &Cells, max_sigma_m: f64) -> Result<Self> {
        let score = |inverse: &Matrix6<f64>| cells.clustered_scores(inverse);
        let significant = |motion: &Vector6<f64>, information| information > SIGNIFICANCE * cells.scatter(motion);
        let directions = Directions::new(&cells.information(), score, significant, ROUNDING, max_sigma_m)?;
        Ok(Self { frame: cells.frame, directions })
    }

    /// The pose without what happened along undetermined motions since the guess, and the motions that may still be taken;
    /// `None` where all motions are determined.
    ///
    /// What a motion is worth shows at the answer only: far off, and between coarse levels, everything seems to matter.
    pub fn back_at(&self, guess: &Isometry3<f64>, pose: &Isometry3<f64>) -> Option<(Isometry3<f64>, Free)> {
        let (frame, projection) = (self.frame, self.directions.free());
        let slide = (guess * pose.inverse() * Point3::from(frame.centre)).coords - frame.centre;
        let turn = (guess.rotation * pose.rotation.inverse()).scaled_axis() * frame.radius_m;
        let back = Vector6::new(slide.x, slide.y, slide.z, turn.x, turn.y, turn.z);
        let all = self.directions.all().iter().all(|d| d.determined);
        (!all).then(|| (frame.moved(pose, &(back - projection * back)), Free { frame: Some(frame), projection }))
    }

    /// A step `[dt, rho w]` over the standard deviation, along the determined motion where that is largest.
    pub fn over_sigma(&self, step: &Vector6<f64>) -> f64 {
        let determined = self.directions.all().iter().filter(|d| d.determined);
        determined.map(|d| d.vector.dot(step).abs() / d.sigma_m.max(f64::MIN_POSITIVE)).fold(0.0, f64::max)
    }

    /// The undetermined motions, sorted into translations and rotations.
    pub fn undetermined(&self) -> Vec<UndeterminedMotion> {
        self.directions.undetermined(&self.frame)
    }

    /// Covariance in the tangent `[dt target axes, dtheta source axes]`: the sandwich `A⁻¹ M A⁻ᵀ` with the response A of
    /// the score. What is not known at all gets the radius of the pairs as sigma.
    pub fn covariance(&self, pose: &Isometry3<f64>, response: Option<&Matrix6<f64>>) -> Matrix6<f64> {
        let centred = self.directions.covariance(self.frame.radius_m, response);
        let to_tangent = self.frame.tangent_from_motion(pose);
        symmetrised(&(to_tangent * centred * to_tangent.transpose()))
    }
}
