//! Range-error models for several integration times (Sect. 4.6).

use crate::{Error, ModelSet, RangeErrorModel, Result};

/// Integration times that differ by less than this part of themselves are the same one: they went through
/// a file or a unit conversion.
const SAME_TIME: f64 = 1e-6;

impl ModelSet {
    /// The models of this integration time (within 1e-6 of it), one per modulation frequency.
    pub fn select(&self, integration_time_s: f64) -> Result<&[RangeErrorModel]> {
        self.select_nearest(integration_time_s, SAME_TIME)
    }

    /// The models of the nearest integration time, if that differs by at most `relative_tolerance` times
    /// the time asked for.
    pub fn select_nearest(&self, integration_time_s: f64, relative_tolerance: f64) -> Result<&[RangeErrorModel]> {
        let distance = |time: f64| (time - integration_time_s).abs();
        self.entries
            .iter()
            .min_by(|a, b| distance(a.0).total_cmp(&distance(b.0)))
            .filter(|(time, _)| distance(*time) <= relative_tolerance * integration_time_s.abs())
            .map(|(_, models)| models.as_slice())
            .ok_or_else(|| Error::NoModelForIntegrationTime {
                integration_time_s,
                available_s: self.entries.iter().map(|(time, _)| *time).collect(),
            })
    }

    /// Refuses times that are not positive, finite and ascending, entries without a model or with another
    /// number of frequencies than the first, and bad models.
    pub fn validate(&self) -> Result<()> {
        let mut earlier = 0.0;
        for (time, models) in &self.entries {
            if !(time.is_finite() && *time > earlier) {
                return Err(Error::OutOfDomain {
                    name: "integration time",
                    value: *time,
                    expected: "integration times are positive, finite and ascending",
                });
            }
            earlier = *time;
            if models.is_empty() || models.len() != self.entries[0].1.len() {
                return Err(Error::OutOfDomain {
                    name: "models of an integration time",
                    value: models.len() as f64,
                    expected: "each integration time has one model per modulation frequency, and at least one",
                });
            }
            models.iter().try_for_each(RangeErrorModel::validate)?;
        }
        Ok(())
    }
}
