//! Refuses parts whose parameters are outside their domain.

use rigid_pose::{require_count, require_positive};

use super::{Levels, Registration, prior};
use crate::error::Result;
use crate::parts::Scene;
use crate::result::DegeneracyPolicy;

impl Registration<'_> {
    pub(super) fn validate(&self, scene: &Scene<'_>) -> Result<()> {
        self.metric.validate(scene)?;
        self.minimisation.validate(&*self.metric)?;
        require_count("max_iterations", self.max_iterations, 1)?;
        self.levels.validate()?;
        self.starts.map_or(Ok(()), |starts| starts.validate())?;
        for alternative in &self.alternatives {
            if let Some(metric) = &alternative.metric {
                metric.validate(scene)?;
                self.minimisation.validate(&**metric)?;
            }
        }
        let elsewhere = self.alternatives.iter().flat_map(|alternative| &alternative.rejection);
        for rejection in self.rejection.iter().chain(elsewhere) {
            rejection.validate()?;
        }
        if self.degeneracy == DegeneracyPolicy::HoldAtPrior {
            prior::validate(self.prior_covariance.as_ref())?;
        }
        require_positive("max_motion_sigma_m", self.max_motion_sigma_m)?;
        Ok(require_count("min_correspondences", self.min_correspondences, 3)?)
    }
}

impl Levels {
    fn validate(&self) -> Result<()> {
        require_positive("max_correspondence_distance_m", self.last_limit_m)?;
        require_positive("initial_correspondence_distance_m", self.first_limit_m)?;
        require_positive("step_fraction", self.step_fraction)?;
        require_count("points", self.points, 1)?;
        Ok(require_count("iterations", self.iterations, 1)?)
    }
}
