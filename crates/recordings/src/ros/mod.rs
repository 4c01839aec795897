//! Messages of ROS 1 and ROS 2: the types that are understood, and how their bytes are laid out.

mod decode;
#[cfg(feature = "mcap")]
mod definitions;
#[cfg(feature = "mcap")]
mod encode;
mod fields;

pub(crate) use decode::{Decoded, decode};
#[cfg(feature = "mcap")]
pub(crate) use definitions::definition;
#[cfg(feature = "mcap")]
pub(crate) use encode::encode;

use crate::contents::Kind;

/// A type of message that is understood.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum MessageType {
    Image,
    CompressedImage,
    CameraInfo,
    Imu,
    Temperature,
    Transforms,
}

/// How the bytes of a message are laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Layout {
    /// ROS 1: no gaps, little-endian, a header with a number.
    #[cfg_attr(not(feature = "bag"), allow(dead_code))]
    Ros1,
    /// ROS 2: the common data representation (CDR), values at multiples of their size.
    #[cfg_attr(not(feature = "mcap"), allow(dead_code))]
    Cdr,
}

const TYPES: [(&str, MessageType); 5] = [
    ("Image", MessageType::Image),
    ("CompressedImage", MessageType::CompressedImage),
    ("CameraInfo", MessageType::CameraInfo),
    ("Imu", MessageType::Imu),
    ("Temperature", MessageType::Temperature),
];

/// Package and name of the type that says where coordinate systems lie.
const TRANSFORMS: [&str; 2] = ["tf2_msgs", "TFMessage"];

impl MessageType {
    /// The type of this name in the words of ROS 1 (`sensor_msgs/Image`) or ROS 2 (`sensor_msgs/msg/Image`).
    pub fn of(name: &str) -> Option<Self> {
        let (package, short) = name.split_once('/')?;
        let short = short.strip_prefix("msg/").unwrap_or(short);
        if [package, short] == TRANSFORMS {
            return Some(Self::Transforms);
        }
        if package != "sensor_msgs" {
            return None;
        }
        TYPES.iter().find(|(known, _)| *known == short).map(|(_, known)| *known)
    }

    /// What is known of a stream of this type before its first message.
    pub fn kind(self, topic: &str) -> Kind {
        match self {
            Self::Image => Kind::Image,
            Self::CompressedImage if topic.to_ascii_lowercase().contains("depth") => Kind::Depth,
            Self::CompressedImage => Kind::Colour,
            Self::CameraInfo => Kind::CameraInfo,
            Self::Imu => Kind::Imu,
            Self::Temperature => Kind::Temperature,
            Self::Transforms => Kind::Transforms,
        }
    }

    #[cfg(feature = "mcap")]
    pub fn ros2_name(self) -> String {
        if self == Self::Transforms {
            return TRANSFORMS.join("/msg/");
        }
        let short = TYPES.iter().find(|(_, known)| *known == self).map_or("", |(name, _)| name);
        format!("sensor_msgs/msg/{short}")
    }
}
