//! Refuses parts whose parameters are outside their domain.

use super::{Levels, Registration, prior};
use crate::error::{Error, Result};
use crate::parts::Scene;
use crate::result::DegeneracyPolicy;

impl Registration<'_> {
    pub(super) fn validate(&self, scene: &Scene<'_>) -> Result<()> {
        self.matching.validate()?;
        self.metric.validate(scene)?;
        self.minimisation.validate(scene, &*self.metric)?;
        self.kernel.validate()?;
        self.stopping.validate()?;
        self.levels.validate()?;
        self.starts.map_or(Ok(()), |starts| starts.validate())?;
        for alternative in &self.alternatives {
            alternative.kernel.validate()?;
            if let Some(metric) = &alternative.metric {
                metric.validate(scene)?;
                self.minimisation.validate(scene, &**metric)?;
            }
        }
        let elsewhere = self.alternatives.iter().flat_map(|alternative| &alternative.rejection);
        for rejection in self.rejection.iter().chain(elsewhere) {
            rejection.validate(scene)?;
        }
        for weighting in &self.weighting {
            weighting.validate()?;
        }
        if self.degeneracy == DegeneracyPolicy::HoldAtPrior {
            prior::validate(self.prior_covariance.as_ref())?;
        }
        positive("max_motion_sigma_m", self.max_motion_sigma_m)?;
        if self.min_correspondences < 3 {
            let value = self.min_correspondences as f64;
            return Err(Error::InvalidOption { name: "min_correspondences", value, domain: "3 or more" });
        }
        Ok(())
    }
}

impl Levels {
    fn validate(&self) -> Result<()> {
        positive("max_correspondence_distance_m", self.last_limit_m)?;
        positive("initial_correspondence_distance_m", self.first_limit_m)?;
        positive("step_fraction", Some(self.step_fraction))?;
        for (name, value) in [("points", self.points), ("iterations", self.iterations)] {
            if value == 0 {
                return Err(Error::InvalidOption { name, value: 0.0, domain: "1 or more" });
            }
        }
        Ok(())
    }
}

fn positive(name: &'static str, value: Option<f64>) -> Result<()> {
    match value {
        Some(value) if !(value > 0.0 && value.is_finite()) => {
            Err(Error::InvalidOption { name, value, domain: "positive and finite" })
        }
        _ => Ok(()),
    }
}
