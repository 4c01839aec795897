//! Terms that the camera has and that are not estimated: an adjustment with them tells.

use calibration_network::functional_model::SINES;

use super::frequency::other_interval;
use crate::choice::auto_terms::joint_test;
use crate::contradictions::suspicion::Suspicion;
use crate::findings::contradiction::{Cause, CauseKind};
use crate::methods::problem::Problem;
use crate::{CalibrationOptions, CalibrationOutcome, TermScore, TermSelection};

/// Probability that a group of terms is told that a sound network does not have.
const LEVEL: f64 = 1e-4;
/// Groups of terms that are added one after the other.
const MOST: usize = 6;
/// Sensors have pixels as square as this; more is a pitch in error.
const LARGEST_AFFINITY: f64 = 0.01;

impl Problem<'_> {
    /// What the residuals show of terms that are not estimated, or of waves of another length.
    pub(super) fn missing(&self, outcome: &CalibrationOutcome) -> Option<Cause> {
        let TermSelection::List(listed) = &self.options.terms else { return None };
        let mut terms = listed.clone();
        let mut with = None;
        let mut added: Vec<TermScore> = Vec::new();
        let mut failed: Vec<Vec<String>> = Vec::new();
        for _ in 0..MOST {
            let current = with.as_ref().unwrap_or(outcome);
            let is_shown =
                |group: &&TermScore| group.p < LEVEL && group.delta_bic < 0.0 && !failed.contains(&group.terms);
            let shown = current.unestimated.iter().filter(is_shown);
            let Some(group) = shown.min_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic)).cloned() else { break };
            let more: Vec<String> = terms.iter().chain(&group.terms).cloned().collect();
            match self.with_terms(&more) {
                Some(better) => {
                    (terms, with) = (more, Some(better));
                    added.push(group);
                }
                None => failed.push(group.terms),
            }
        }
        let with = with?;
        let tested = added.iter().filter_map(|group| {
            let terms: Vec<&str> = group.terms.iter().map(String::as_str).collect();
            Some((group, joint_test(&with, &terms)?))
        });
        let shown: Vec<(&TermScore, f64)> = tested
            .filter(|(_, test)| test.p < LEVEL && test.delta_bic < 0.0)
            .map(|(group, test)| (group, -0.5 * test.delta_bic))
            .collect();
        let log_odds = shown.iter().map(|(_, odds)| odds).sum();
        let names: Vec<String> = shown.iter().flat_map(|(group, _)| group.terms.iter().cloned()).collect();
        if names.is_empty() {
            return None;
        }
        let waves = names.iter().any(|name| SINES.contains(&name.as_str()));
        let other = waves.then(|| self.of_other_waves(outcome, &with)).flatten();
        Some(other.unwrap_or_else(|| self.cause(outcome, &with, names, log_odds)))
    }

    fn with_terms(&self, terms: &[String]) -> Option<CalibrationOutcome> {
        let options = CalibrationOptions { terms: TermSelection::List(terms.to_vec()), ..self.options.clone() };
        (Problem { options: &options, ..*self }).calibrate().ok()
    }

    /// Waves of another modulation frequency, where these explain the ranges better than more waves.
    fn of_other_waves(&self, outcome: &CalibrationOutcome, with: &CalibrationOutcome) -> Option<Cause> {
        let interval_m = other_interval(self.network, outcome)?;
        let mut network = self.network.clone();
        let given = network.range_model.ambiguity_interval_m;
        network.range_model.ambiguity_interval_m = interval_m;
        let other = (Problem { network: &network, ..*self }).calibrate().ok()?;
        let is_better = other.rejected() <= outcome.rejected() && other.bic < with.bic;
        is_better.then(|| Cause {
            kind: CauseKind::ModulationFrequency,
            station: None,
            names: Vec::new(),
            words: format!(
                "the waves of the range error fit if the modulation frequency is {:.2} times that given (an ambiguity \
                 interval of {interval_m:.3} m instead of {given:.3} m)",
                given / interval_m
            ),
            remedy: "mend `modulation_hz` in survey.ron, or of calibration.ron",
            log_odds: 0.5 * (outcome.bic - other.bic),
        })
    }

    fn cause(
        &self,
        outcome: &CalibrationOutcome,
        with: &CalibrationOutcome,
        names: Vec<String>,
        log_odds: f64,
    ) -> Cause {
        let b1 = with.parameter("b1").map_or(0.0, |b1| b1.value);
        if names.iter().any(|name| name == "b1") && b1.abs() > LARGEST_AFFINITY {
            let [x, y] = self.network.camera.format.pixel_pitch_mm;
            let words = format!(
                "the image points fit if the columns are {:.5} mm apart where {x} mm are given, beside rows of {y} mm",
                x * (1.0 - b1)
            );
            let remedy = "mend `pixel_pitch_mm` of the camera in survey.ron, or of calibration.ron";
            return Cause { kind: CauseKind::PixelPitch, station: None, names: Vec::new(), words, remedy, log_odds };
        }
        let [before, after] = [outcome, with].map(|outcome| outcome.sigma0.unwrap_or(f64::NAN));
        let doubtful =
            if Suspicion::new(with, self.network).is_none() { "" } else { ", and are not all that is wrong" };
        Cause {
            kind: CauseKind::MissingTerms,
            station: None,
            words: format!(
                "the observations show `{}`, which {} not estimated: sigma0 falls from {before:.3} to {after:.3} with \
                 {}{doubtful}",
                names.join("`, `"),
                if names.len() == 1 { "is" } else { "are" },
                if names.len() == 1 { "it" } else { "them" },
            ),
            names,
            remedy: "estimate them as well, or let terms be chosen automatically",
            log_odds,
        }
    }
}
