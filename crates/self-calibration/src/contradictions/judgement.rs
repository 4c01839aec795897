//! Whether a calibration is given, given with doubts, or refused with what contradicts.

use crate::contradictions::rejection_words::sentences;
use crate::contradictions::suspicion::Suspicion;
use crate::findings::contradiction::Contradiction;
use crate::methods::problem::Problem;
use crate::{CalibrationOutcome, Error, Method, NetworkError, Result};

/// An outcome with what speaks against it.
struct Judged {
    outcome: CalibrationOutcome,
    suspicion: Suspicion,
}

impl Problem<'_> {
    /// Calibrates; where the result is suspicious, once more from where most observations agree; where it stays so, looks
    /// for the cause.
    pub(crate) fn judged(&self) -> Result<CalibrationOutcome> {
        if self.options.method == Method::Laboratory {
            let mut outcome = self.calibrate()?;
            outcome.doubts.extend(outcome.doubts_of_tests());
            return Ok(outcome);
        }
        let best = match self.attempt() {
            Ok(judged) if judged.suspicion.is_none() => judged,
            Ok(judged) => self.again(judged),
            Err(error) if !may_contradict(&error) => return Err(error),
            Err(error) => match self.once_more(&error) {
                Some(judged) => judged,
                None if self.lens.is_some() => return Err(error),
                None => return Err(self.refusal(error)),
            },
        };
        let best = best.explained(self);
        if best.suspicion.is_none() || self.lens.is_some() {
            return Ok(best.told(self));
        }
        let mut contradiction = Contradiction::new("too many observations disagree with the result");
        contradiction.causes = best.suspicion.causes(self.network);
        if contradiction.causes.is_empty() {
            contradiction.causes.clone_from(&best.outcome.causes);
            if !contradiction.causes.is_empty() && !best.suspicion.is_hopeless() {
                return Ok(best.told(self));
            }
        }
        if contradiction.causes.is_empty() {
            let suspected: Vec<String> = best.suspicion.stations.iter().map(|(name, ..)| name.clone()).collect();
            (contradiction, _) = self.contradiction(contradiction.stage, None, &suspected);
        }
        if !contradiction.causes.is_empty() || best.suspicion.is_hopeless() {
            return Err(Error::Contradiction(Box::new(contradiction)));
        }
        Ok(best.told(self))
    }

    fn attempt(&self) -> Result<Judged> {
        let outcome = self.calibrate()?;
        let suspicion = Suspicion::new(&outcome, self.network);
        Ok(Judged { outcome, suspicion })
    }

    /// A calibration from a robust start, where the first one found no end.
    fn once_more(&self, error: &Error) -> Option<Judged> {
        error.is_without_end().then(|| (Problem { robust: true, ..*self }).attempt().ok()).flatten()
    }

    /// The better of a suspicious calibration and that from a robust start.
    fn again(&self, first: Judged) -> Judged {
        match (Problem { robust: true, ..*self }).attempt() {
            Ok(second) if second.suspicion.is_lighter_than(&first.suspicion) => second,
            _ => first,
        }
    }

    /// Why there is no result: the cause, where one is found.
    fn refusal(&self, error: Error) -> Error {
        let stage = match &error {
            Error::Network(NetworkError::WeakNetwork { .. }) => "parameters cannot be told apart",
            error if error.is_without_end() => "the adjustment found no end",
            _ => "no start values were found",
        };
        let (contradiction, contradicts) = self.contradiction(stage, Some(&error), &[]);
        // Without a cause, a consistent network that is unreachable or weak is what it was said to be.
        if contradiction.causes.is_empty() && !contradicts && !error.is_without_end() {
            return error;
        }
        Error::Contradiction(Box::new(contradiction))
    }
}

/// Errors that contradictory observations may be behind.
fn may_contradict(error: &Error) -> bool {
    error.is_without_end()
        || matches!(
            error,
            Error::Network(
                NetworkError::WeakNetwork { .. } | NetworkError::NotReachable { .. } | NetworkError::Orientation(_)
            )
        )
}

impl Judged {
    /// The same with what the outcome itself shows to be wrong.
    fn explained(mut self, problem: &Problem<'_>) -> Self {
        self.outcome.causes = problem.shown(&self.outcome);
        self
    }

    /// The outcome with its doubts, and what would explain what was rejected.
    fn told(self, problem: &Problem<'_>) -> CalibrationOutcome {
        let mut outcome = self.outcome;
        outcome.doubts.extend(outcome.causes.iter().map(ToString::to_string));
        outcome.doubts.extend(self.suspicion.sentences());
        outcome.doubts.extend(outcome.doubts_of_tests());
        let more = sentences(&outcome, problem.network);
        outcome.diagnosis.extend(more);
        outcome
    }
}
