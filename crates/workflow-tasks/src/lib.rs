#![doc = include_str!("../README.md")]

mod archive;
mod fleet;
mod workflow;

pub use commands;
pub use fleet::{
    Calibration, Camera, DayCheck, DoubtCount, FailureCount, Fleet, FleetRequest, Recorded, RecordingRow, fleet,
};
pub use workflow::{WorkflowRequest, WorkflowSummary, write_workflow};
