//! Tracking as a command: the frames of a moving camera in, its path, a map, figures and a report out.

mod frames;
mod imu;
mod outcome;
mod request;
mod results;
mod run;
mod start;
mod summary;

pub use outcome::{TrackLoss, TrackTruth, TrackVerdict, TrackedFrame};
pub use request::TrackRequest;
pub use run::track;
pub use summary::TrackSummary;

pub(crate) use outcome::Tracked;
