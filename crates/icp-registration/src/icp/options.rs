//! What can be chosen in an ICP run.

use crate::error::{Error, Result};
use crate::kernel::RobustKernel;

/// What is minimised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Metric {
    /// Distance of the points `[BeslMcKay1992]`. Converges slowly, and sampling of the surface enters the result.
    PointToPoint,
    /// Distance of the source point from the tangent plane of the target `[ChenMedioni1992]`.
    #[default]
    PointToPlane,
}

/// Which source points take part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Selection {
    /// All.
    #[default]
    All,
    /// Every n-th in the order of the cloud.
    EveryNth(usize),
    /// About this many, spread evenly over the directions of the normals `[RusinkiewiczLevoy2001]`: what few points
    /// say about a sliding direction is not drowned by a large wall.
    NormalSpace(usize),
}

/// What happens to motions that the geometry does not determine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum DegeneracyPolicy {
    /// They are named in the result; the pose may have slid along them.
    #[default]
    Report,
    /// They are named, and the pose keeps the guess along them (to first order).
    HoldAtGuess,
}

/// Options of an ICP run. The defaults carry no scale: distances left at `None` come from the clouds.
#[derive(Debug, Clone, PartialEq)]
pub struct IcpOptions {
    /// What is minimised.
    pub metric: Metric,
    /// Source points that take part.
    pub selection: Selection,
    /// Largest distance of a pair at the end, metre. `None`: three times the spacing of the target (90 % quantile).
    pub max_correspondence_distance_m: Option<f64>,
    /// Largest distance of a pair at the start, halved level by level down to the one above. `None`: 2.5 times the
    /// median distance at the guess, but at least a quarter of the target's radius and at most all of it.
    pub initial_correspondence_distance_m: Option<f64>,
    /// Robust kernel on the residuals; its scale is their median absolute deviation, anew in each iteration.
    pub kernel: RobustKernel,
    /// Fraction of the pairs that is kept, those with the smallest distances `[Chetverikov2002]`. Default 1: all.
    pub trim: f64,
    /// Pairs whose normals enclose a larger angle are refused, radian (the sign of normals does not count).
    /// Default 45 degrees; `None`: normals are not compared.
    pub max_normal_angle_rad: Option<f64>,
    /// Iterations in all levels together. Default 100.
    pub max_iterations: usize,
    /// The run has converged when the step moves points at the cloud's radius by less than this, metre. `None`: 1e-5 of
    /// that radius.
    pub step_tolerance_m: Option<f64>,
    /// What happens to undetermined motions.
    pub degeneracy: DegeneracyPolicy,
    /// A motion counts as undetermined when the predicted standard deviation of points at the cloud's radius exceeds
    /// this, metre. `None`: 1/300 of the radius.
    pub max_motion_sigma_m: Option<f64>,
    /// Fewest pairs. Default 20.
    pub min_correspondences: usize,
}

impl Default for IcpOptions {
    fn default() -> Self {
        Self {
            metric: Metric::PointToPlane,
            selection: Selection::All,
            max_correspondence_distance_m: None,
            initial_correspondence_distance_m: None,
            kernel: RobustKernel::Welsch,
            trim: 1.0,
            max_normal_angle_rad: Some(std::f64::consts::FRAC_PI_4),
            max_iterations: 100,
            step_tolerance_m: None,
            degeneracy: DegeneracyPolicy::Report,
            max_motion_sigma_m: None,
            min_correspondences: 20,
        }
    }
}

impl IcpOptions {
    pub(crate) fn validate(&self) -> Result<()> {
        let lengths = [
            ("max_correspondence_distance_m", self.max_correspondence_distance_m),
            ("initial_correspondence_distance_m", self.initial_correspondence_distance_m),
            ("step_tolerance_m", self.step_tolerance_m),
            ("max_motion_sigma_m", self.max_motion_sigma_m),
            ("max_normal_angle_rad", self.max_normal_angle_rad),
        ];
        for (name, value) in lengths {
            if let Some(value) = value
                && !(value > 0.0 && value.is_finite())
            {
                return Err(Error::InvalidOption { name, value, domain: "positive and finite" });
            }
        }
        if !(self.trim > 0.0 && self.trim <= 1.0) {
            return Err(Error::InvalidOption { name: "trim", value: self.trim, domain: "above 0 and at most 1" });
        }
        let counts = [("max_iterations", self.max_iterations, 1), ("min_correspondences", self.min_correspondences, 3)];
        for (name, value, least) in counts {
            if value < least {
                let domain = if least == 1 { "1 or more" } else { "3 or more" };
                return Err(Error::InvalidOption { name, value: value as f64, domain });
            }
        }
        match self.selection {
            Selection::EveryNth(0) => {
                Err(Error::InvalidOption { name: "selection", value: 0.0, domain: "every 1st or more" })
            }
            Selection::NormalSpace(0) => {
                Err(Error::InvalidOption { name: "selection", value: 0.0, domain: "1 point or more" })
            }
            _ => Ok(()),
        }
    }
}
