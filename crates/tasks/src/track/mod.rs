//! Tracking as a command: the frames of a moving camera in, its path, a map, figures and a report out.

pub(crate) mod document;
pub(crate) mod figures;
pub(crate) mod frames;
pub(crate) mod imu;
pub(crate) mod outcome;
pub(crate) mod request;
pub(crate) mod results;
pub(crate) mod run;
pub(crate) mod start;
pub(crate) mod summary;

pub use outcome::{TrackLoss, TrackTruth, TrackVerdict, TrackedFrame};
pub use request::TrackRequest;
pub use run::track;
pub use summary::TrackSummary;
