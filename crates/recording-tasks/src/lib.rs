#![doc = include_str!("../README.md")]

mod access;
mod convert;
mod inspect;

pub use access::is_recording;
pub use commands;
pub use convert::{CameraUsed, ConvertRequest, ConvertSummary, ImuUsed, Skipped, convert};
pub use inspect::{
    AttachmentReport, CameraReport, Gap, Property, RecordingInspection, StreamReport, TemperatureReport,
    inspect_recording,
};
pub use range_io;
pub use recordings;
