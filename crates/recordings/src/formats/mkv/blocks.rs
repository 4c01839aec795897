//! Blocks: one frame of a track, or several behind each other.

use super::elements::{Keep, number};
use crate::payload::{Imu, Measured};

/// A block's head and frames.
pub(super) struct Block<'a> {
    pub track: u64,
    /// Time relative to the cluster's.
    pub ticks: i16,
    pub frames: Vec<&'a [u8]>,
}

impl<'a> Block<'a> {
    /// Track number, time, flags, then frames; what is wrong in words.
    pub fn read(data: &'a [u8]) -> Result<Self, String> {
        let short = || "a block is shorter than its head".to_owned();
        let (track, rest) = number(data, 8, Keep::Value).ok_or_else(short)?;
        let ([high, low, flags], rest) = rest.split_first_chunk::<3>().ok_or_else(short)?;
        let frames = match flags & 0b110 {
            0 => Some(vec![rest]),
            0b100 => fixed(rest),
            0b010 => split(rest, xiph),
            _ => split(rest, ebml),
        };
        let frames = frames.ok_or("a block's frames do not fit into it")?;
        Ok(Self { track: track.ok_or_else(short)?, ticks: i16::from_be_bytes([*high, *low]), frames })
    }
}

/// Frames of equal size behind their number less one.
fn fixed(data: &[u8]) -> Option<Vec<&[u8]>> {
    let (&more, rest) = data.split_first()?;
    let count = more as usize + 1;
    (!rest.is_empty() && rest.len() % count == 0).then(|| rest.chunks(rest.len() / count).collect())
}

/// Sizes of some frames, and what is behind them.
type Sizes<'a> = Option<(Vec<usize>, &'a [u8])>;

/// Frames behind their number less one and the sizes of all but the last.
fn split(data: &[u8], sizes: fn(usize, &[u8]) -> Sizes) -> Option<Vec<&[u8]>> {
    let (&more, rest) = data.split_first()?;
    let (sizes, mut rest) = sizes(more as usize, rest)?;
    let mut frames = Vec::new();
    for size in sizes {
        let (frame, behind) = rest.split_at_checked(size)?;
        frames.push(frame);
        rest = behind;
    }
    frames.push(rest);
    Some(frames)
}

/// Sizes as sums of bytes, each list ended by one below 255.
fn xiph(count: usize, mut data: &[u8]) -> Sizes<'_> {
    let mut sizes = Vec::new();
    for _ in 0..count {
        let mut size = 0;
        loop {
            let (&byte, rest) = data.split_first()?;
            data = rest;
            size += byte as usize;
            if byte < 255 {
                break;
            }
        }
        sizes.push(size);
    }
    Some((sizes, data))
}

/// The first size as a number of its own length, further ones as differences with a sign.
fn ebml(count: usize, data: &[u8]) -> Sizes<'_> {
    let (mut sizes, mut data, mut last) = (Vec::new(), data, 0_i64);
    for index in 0..count {
        let length = data.first()?.leading_zeros() + 1;
        let (value, rest) = number(data, 8, Keep::Value)?;
        let value = value? as i64;
        // A difference is counted from the middle of what its length can hold.
        let middle = (1_i64 << (7 * length - 1)) - 1;
        last = if index == 0 { value } else { last.checked_add(value - middle)? };
        sizes.push(usize::try_from(last).ok()?);
        data = rest;
    }
    Some((sizes, data))
}

/// Bytes of a sample of the inertial unit: a time and three values, twice.
const IMU_SAMPLE: usize = 40;

/// A sample of the inertial unit: the device's times of specific force and angular velocity in nanoseconds, and both.
pub(super) fn imu(frame: &[u8]) -> Result<([u64; 2], Imu), String> {
    let bytes: &[u8; IMU_SAMPLE] =
        frame.try_into().map_err(|_| format!("has a sample of {} bytes, expected {IMU_SAMPLE}", frame.len()))?;
    let time = |at: usize| u64::from_le_bytes(std::array::from_fn(|byte| bytes[at + byte]));
    let value = |at: usize| {
        let values: [f32; 3] =
            std::array::from_fn(|axis| f32::from_le_bytes(std::array::from_fn(|byte| bytes[at + 4 * axis + byte])));
        Measured { value: values.map(f64::from), covariance: [0.0; 9] }
    };
    let imu = Imu {
        frame_id: "IMU".to_owned(),
        linear_acceleration: Some(value(8)),
        angular_velocity: Some(value(28)),
        ..Imu::default()
    };
    Ok(([time(0), time(20)], imu))
}
