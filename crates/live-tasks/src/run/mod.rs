//! A stream of frames, from its source to clouds, a status and a page.

mod datum;
mod drift;
mod feed;
mod latency;
mod outputs;
mod path;
mod request;
mod session;
mod setup;
mod summary;
mod tally;

pub use drift::{DriftReport, DriftVerdict};
pub use latency::LatencySummary;
pub use path::{MapReport, PathLoss, PathReport, PathStatus, PathVerdict};
pub use request::{LiveRequest, LiveTracking, LiveWatch};
pub use session::{live, live_from};
pub use summary::{Ended, LiveStatus, LiveSummary};
pub use tally::RefusedFrames;
