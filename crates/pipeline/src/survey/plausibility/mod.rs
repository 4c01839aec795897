//! Whether a survey and its result can be what they claim: each finding a [`Doubt`](crate::Doubt) in one line.
//!
//! What is asked is what a camera and a person cannot have meant: units, frames that hold nothing, a phase that runs the
//! wrong way, stations that are not known or not where they were said to be. How good a sound result is, is not asked.

pub(crate) mod frames;
pub(crate) mod placed;
pub(crate) mod result;
pub(crate) mod sense;
pub(crate) mod statement;
pub(crate) mod stored;

pub use frames::FrameWatch;
pub use placed::{PlacedStation, displaced, uncertain, uncertain_frames};
pub use result::{beyond_maximum, mostly_flagged, of_views, stated_sigma};
pub use sense::SenseVotes;
pub use statement::{far_apart, of_survey};
pub use stored::StoredWatch;

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
