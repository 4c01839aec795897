#![doc = include_str!("../README.md")]

mod ply;
mod run;
mod sources;
mod view;
mod wire;

pub use commands;
pub use live_frames;
pub use ply::PlyStream;
pub use range_image;
pub use run::{
    DriftReport, DriftVerdict, Ended, LatencySummary, LiveRequest, LiveStatus, LiveSummary, LiveWatch, PlyTarget,
    RefusedFrames, live, live_from,
};
pub use sources::{FrameSource, LiveSource, Next};
pub use view::LiveView;
pub use wire::{FrameError, FrameHeader, FrameStream, LiveFrame, SampleType, write_live_frame};
