#![doc = include_str!("../README.md")]

mod contents;
mod error;
mod formats;
mod input;
pub mod limits;
mod message;
mod payload;
mod recording;
#[cfg(any(feature = "mcap", feature = "bag"))]
mod ros;

pub use contents::{Attachment, Ending, Fault, Kind, Stream};
pub use error::Error;
#[cfg(feature = "mcap")]
pub use formats::mcap::{McapWriter, StreamId};
pub use message::Message;
pub use payload::{CameraInfo, CompressedImage, Encoding, Image, ImageParts, Imu, Measured, Payload, Transform};
pub use recording::{Format, Recording};
