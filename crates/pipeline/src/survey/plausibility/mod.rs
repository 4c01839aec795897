//! Whether a survey and its result can be what they claim: each finding a [`Doubt`](crate::Doubt) in one line.
//!
//! What is asked is what a camera and a person cannot have meant: units, frames that hold nothing, a phase that runs the
//! wrong way, stations that are not known or not where they were said to be. How good a sound result is, is not asked.

pub(crate) mod frames;
pub(crate) mod placed;
pub(crate) mod result;
pub(crate) mod sense;
pub(crate) mod statement;

use crate::Result;
use crate::plan::Stage;
use crate::survey::outcome::Outcome;
use crate::survey::plausibility::result::beyond_maximum;
use crate::survey::work::Work;
pub use frames::FrameWatch;
pub use placed::{PlacedStation, displaced, uncertain, uncertain_frames};
pub use result::{of_outcome, stated_sigma};
pub use sense::SenseVotes;
pub use statement::{far_apart, of_survey};

/// Metre: nearer or further than any time-of-flight camera of this kind measures, and what metres become when they are
/// taken for millimetres or kilometres.
const NEAREST_M: f64 = 0.02;
const FURTHEST_M: f64 = 100.0;

/// "S1, S2, S3 and 4 more".
pub(crate) fn some_of<S: AsRef<str>>(names: &[S]) -> String {
    const NAMED: usize = 5;
    let listed: Vec<&str> = names.iter().take(NAMED).map(AsRef::as_ref).collect();
    match names.len().saturating_sub(NAMED) {
        0 => listed.join(", "),
        more => format!("{} and {more} more", listed.join(", ")),
    }
}

/// What can be told of the views before a stage: of phases, whether they grow with range.
pub fn before(stage: &Stage, outcome: &mut Outcome) {
    if matches!(stage, Stage::Unwrap(_)) {
        let mut votes = SenseVotes::default();
        outcome.views.iter().for_each(|view| votes.look_at(view));
        outcome.doubts.extend(votes.doubt());
    }
}

/// What can be told of them after it: of unwrapped ranges, whether they are too long; of corrected ones, whether the
/// calibration holds for them.
///
/// # Errors
/// [`Error::Incompatible`](crate::Error::Incompatible) for a calibration that holds for none of the ranges.
pub fn after(stage: &Stage, work: &mut Work) -> Result<()> {
    let maximum_range_m = match stage {
        Stage::Unwrap(options) => options.maximum_range_m,
        Stage::RepairWraps(options) => Some(options.maximum_range_m),
        _ => None,
    };
    if let Some(maximum_range_m) = maximum_range_m {
        let doubts = beyond_maximum(&work.outcome.views, stage.name(), maximum_range_m);
        work.outcome.doubts.extend(doubts);
    }
    if let (Stage::CorrectRange(_), Some(calibration)) = (stage, &work.calibration) {
        work.outcome.doubts.extend(work.span.judge(&calibration.span)?);
    }
    Ok(())
}
