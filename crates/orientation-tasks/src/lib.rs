#![doc = include_str!("../README.md")]

mod camera;
mod document;
mod imu;
mod known;
mod orient;
mod outcome;
mod request;
mod summary;
mod targets;
mod tracker;

pub use orient::orient;
pub use pipeline;
pub use request::{OrientBy, OrientRequest, TrackerOptions};
pub use summary::{
    InertialSummary, MountingSummary, NotOriented, OrientSummary, OrientedStation, RejectedValue, SigmaAtTime,
};
