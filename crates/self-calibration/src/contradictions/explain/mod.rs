//! What a result itself shows to be wrong, though its observations agree well enough to have one.

mod copies;
mod frequency;
mod missing;
mod pitch;
mod sigmas;

use crate::findings::contradiction::Cause;
use crate::methods::problem::Problem;
use crate::{CalibrationOutcome, Method};

impl Problem<'_> {
    /// What explains this result better than the input as it is.
    pub(crate) fn shown(&self, outcome: &CalibrationOutcome) -> Vec<Cause> {
        let mut causes = copies::copies(self.network);
        if self.lens.is_some() || outcome.method == Method::Laboratory {
            return causes;
        }
        causes.extend(pitch::of_camera(self.network, outcome));
        causes.extend(sigmas::units(outcome));
        let frequency =
            frequency::by_size(self.network, outcome).or_else(|| frequency::by_slope(self.network, outcome));
        match frequency {
            Some(cause) => causes.push(cause),
            None => causes.extend(self.missing(outcome)),
        }
        causes
    }
}
