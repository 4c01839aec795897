//! What stands before the samples of a frame.

use std::fmt;

use live_frames::Exposure;
use range_image::Samples;

use super::error::{FrameError, Result};

/// First bytes of every frame.
const MAGIC: [u8; 4] = *b"RCLF";
/// The version of the format.
const VERSION: u16 = 1;
/// Columns, and rows: eight times those of the largest range cameras. Bounds what a damaged header can ask for.
const MOST_PIXELS_A_SIDE: u64 = 4096;
/// Frequencies times phase steps: cameras have up to 9 times 16.
const MOST_PLANES: u64 = 64;

/// Type of the samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SampleType {
    /// Unsigned counts of two bytes.
    U16,
    /// Signed differences of two bytes.
    I16,
    /// Floating point of four bytes.
    F32,
}

impl SampleType {
    /// That of samples.
    pub fn of(samples: &Samples) -> Self {
        match samples {
            Samples::U16(_) => Self::U16,
            Samples::I16(_) => Self::I16,
            Samples::F32(_) => Self::F32,
        }
    }

    /// Bytes of one sample.
    pub fn bytes(self) -> u64 {
        match self {
            Self::U16 | Self::I16 => 2,
            Self::F32 => 4,
        }
    }

    fn code(self) -> u16 {
        match self {
            Self::U16 => 1,
            Self::I16 => 2,
            Self::F32 => 3,
        }
    }
}

/// Header of a frame: 64 bytes, little-endian.
///
/// | byte | type | field |
/// |---|---|---|
/// | 0 | 4 bytes | `RCLF` |
/// | 4 | u16 | version, 1 |
/// | 6 | u16 | type of the samples: 1 u16, 2 i16, 3 f32 |
/// | 8 | u32 | columns W, 1 to 4096 |
/// | 12 | u32 | rows H, 1 to 4096 |
/// | 16 | u16 | modulation frequencies F |
/// | 18 | u16 | phase steps N; F times N is at most 64 |
/// | 20 | u32 | 0 |
/// | 24 | f64 | time stamp, second |
/// | 32 | f64 | integration time, second; NaN: not stated |
/// | 40 | f64 | temperature of the camera, degree Celsius; NaN: not stated |
/// | 48 | u64 | bytes of the samples behind the header: F N H W times the size of one |
/// | 56 | u64 | 0 |
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameHeader {
    /// Type of the samples.
    pub sample_type: SampleType,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Modulation frequencies.
    pub frequencies: usize,
    /// Phase steps of each.
    pub phase_steps: usize,
    /// Time stamp, second.
    pub timestamp_s: f64,
    /// Integration time, second.
    pub integration_time_s: Option<f64>,
    /// Temperature of the camera, degree Celsius.
    pub temperature_c: Option<f64>,
}

impl FrameHeader {
    /// Bytes of a header.
    pub const BYTES: usize = 64;

    /// Samples of the frame.
    pub fn samples(&self) -> usize {
        [self.width, self.height, self.frequencies, self.phase_steps]
            .iter()
            .fold(1, |product, n| product.saturating_mul(*n))
    }

    /// Bytes of the samples.
    pub fn payload(&self) -> u64 {
        (self.samples() as u64).saturating_mul(self.sample_type.bytes())
    }

    /// When and how the frame was taken.
    pub fn exposure(&self) -> Exposure {
        Exposure {
            timestamp_s: self.timestamp_s,
            integration_time_s: self.integration_time_s,
            temperature_c: self.temperature_c,
        }
    }

    /// The header's bytes. Sizes that the format has no room for are cut to what it has; [`Self::parse`] refuses these.
    pub fn to_bytes(&self) -> [u8; Self::BYTES] {
        let mut bytes = [0; Self::BYTES];
        let mut put = |at: usize, value: &[u8]| bytes[at..at + value.len()].copy_from_slice(value);
        let short = |value: usize| u16::try_from(value).unwrap_or(u16::MAX).to_le_bytes();
        let long = |value: usize| u32::try_from(value).unwrap_or(u32::MAX).to_le_bytes();
        put(0, &MAGIC);
        put(4, &VERSION.to_le_bytes());
        put(6, &self.sample_type.code().to_le_bytes());
        put(8, &long(self.width));
        put(12, &long(self.height));
        put(16, &short(self.frequencies));
        put(18, &short(self.phase_steps));
        put(24, &self.timestamp_s.to_le_bytes());
        put(32, &self.integration_time_s.unwrap_or(f64::NAN).to_le_bytes());
        put(40, &self.temperature_c.unwrap_or(f64::NAN).to_le_bytes());
        put(48, &self.payload().to_le_bytes());
        bytes
    }

    /// Reads a header that begins at byte `position` of its stream.
    ///
    /// # Errors
    /// [`FrameError::Field`] for the first field that means nothing.
    pub fn parse(bytes: &[u8; Self::BYTES], position: u64) -> Result<Self> {
        let fields = Fields { bytes, position };
        let magic: [u8; 4] = fields.take(0);
        if magic != MAGIC {
            return Err(fields.wrong(0, "the head of a frame", format!("\"{}\"", magic.escape_ascii()), "\"RCLF\""));
        }
        let short = |at| u64::from(u16::from_le_bytes(fields.take(at)));
        let long = |at| u64::from(u32::from_le_bytes(fields.take(at)));
        fields.require(4, "version", short(4), VERSION.into()..=VERSION.into())?;
        let sample_type = match short(6) {
            1 => SampleType::U16,
            2 => SampleType::I16,
            3 => SampleType::F32,
            other => return Err(fields.wrong(6, "sample type", other, "1 (u16), 2 (i16) or 3 (f32)")),
        };
        let width = fields.require(8, "columns", long(8), 1..=MOST_PIXELS_A_SIDE)?;
        let height = fields.require(12, "rows", long(12), 1..=MOST_PIXELS_A_SIDE)?;
        let frequencies = fields.require(16, "frequencies", short(16), 1..=MOST_PLANES)?;
        let phase_steps = fields.require(18, "phase steps", short(18), 1..=MOST_PLANES / frequencies as u64)?;
        fields.require(20, "reserved", long(20), 0..=0)?;
        let number = |at| f64::from_le_bytes(fields.take(at));
        let (timestamp_s, integration_s, temperature_c) = (number(24), number(32), number(40));
        if !timestamp_s.is_finite() {
            return Err(fields.wrong(24, "time stamp", timestamp_s, "a finite number of seconds"));
        }
        if integration_s.is_infinite() || integration_s <= 0.0 {
            return Err(fields.wrong(
                32,
                "integration time",
                integration_s,
                "positive seconds, or NaN where it is not stated",
            ));
        }
        if temperature_c.is_infinite() {
            return Err(fields.wrong(
                40,
                "temperature",
                temperature_c,
                "degrees Celsius, or NaN where it is not stated",
            ));
        }
        let stated = |value: f64| Some(value).filter(|value| !value.is_nan());
        let (integration_time_s, temperature_c) = (stated(integration_s), stated(temperature_c));
        let header = Self {
            sample_type,
            width,
            height,
            frequencies,
            phase_steps,
            timestamp_s,
            integration_time_s,
            temperature_c,
        };
        let payload = u64::from_le_bytes(fields.take(48));
        fields.require(48, "bytes of samples", payload, header.payload()..=header.payload())?;
        fields.require(56, "reserved", u64::from_le_bytes(fields.take(56)), 0..=0)?;
        Ok(header)
    }
}

/// A header's bytes with their place.
struct Fields<'a> {
    bytes: &'a [u8; FrameHeader::BYTES],
    position: u64,
}

impl Fields<'_> {
    fn take<const N: usize>(&self, at: usize) -> [u8; N] {
        std::array::from_fn(|index| self.bytes[at + index])
    }

    fn wrong(&self, at: u64, field: &'static str, found: impl fmt::Display, expected: impl Into<String>) -> FrameError {
        let (found, expected) = (found.to_string(), expected.into());
        FrameError::Field { position: self.position + at, field, found, expected }
    }

    fn require(&self, at: u64, field: &'static str, value: u64, span: std::ops::RangeInclusive<u64>) -> Result<usize> {
        if span.contains(&value) {
            return Ok(value as usize);
        }
        let (low, high) = (span.start(), span.end());
        let expected = if low == high { low.to_string() } else { format!("{low} to {high}") };
        Err(self.wrong(at, field, value, expected))
    }
}
