#![doc = include_str!("../README.md")]

mod run;
mod sources;
mod streams;
mod view;
mod wire;

pub use commands;
pub use live_frames;
pub use range_image;
pub use run::{
    DriftReport, DriftVerdict, Ended, LatencySummary, LiveRequest, LiveStatus, LiveSummary, LiveTracking, LiveWatch,
    MapReport, PathLoss, PathReport, PathStatus, PathVerdict, RefusedFrames, live, live_from,
};
pub use sources::{FrameSource, LiveSource, Next};
pub use streams::{McapStream, PlyStream, StreamTarget, TrajectoryStream};
pub use view::LiveView;
pub use wire::{FrameError, FrameHeader, FrameStream, LiveFrame, SampleType, write_live_frame};
