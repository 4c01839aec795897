//! Frames into a stream of bytes.

use std::io::{Error, ErrorKind, Result, Write};

use range_image::SampleSlice;

use super::header::{FrameHeader, SampleType};

/// Samples that become bytes at a time.
const BLOCK: usize = 1 << 13;

/// Writes a frame: its header and its samples, `[F, N, H, W]`.
///
/// # Errors
/// [`ErrorKind::InvalidInput`] where samples and header do not fit, or the format has no room for the frame; what the
/// writer says.
pub fn write_live_frame<'a>(
    writer: &mut impl Write,
    header: &FrameHeader,
    samples: impl Into<SampleSlice<'a>>,
) -> Result<()> {
    let samples = samples.into();
    let found = match samples {
        SampleSlice::U16(_) => SampleType::U16,
        SampleSlice::I16(_) => SampleType::I16,
        SampleSlice::F32(_) => SampleType::F32,
    };
    if found != header.sample_type || samples.len() != header.samples() {
        let (length, expected) = (samples.len(), header.samples());
        let words = format!("{length} samples {found:?}, the header says {expected} {:?}", header.sample_type);
        return Err(Error::new(ErrorKind::InvalidInput, words));
    }
    let bytes = header.to_bytes();
    FrameHeader::parse(&bytes, 0).map_err(|error| Error::new(ErrorKind::InvalidInput, error))?;
    writer.write_all(&bytes)?;
    match samples {
        SampleSlice::U16(values) => write_values(writer, values, u16::to_le_bytes),
        SampleSlice::I16(values) => write_values(writer, values, i16::to_le_bytes),
        SampleSlice::F32(values) => write_values(writer, values, f32::to_le_bytes),
    }
}

fn write_values<T: Copy, const N: usize>(
    writer: &mut impl Write,
    values: &[T],
    to_bytes: impl Fn(T) -> [u8; N],
) -> Result<()> {
    let mut bytes = Vec::with_capacity(N * BLOCK.min(values.len()));
    for block in values.chunks(BLOCK) {
        bytes.clear();
        bytes.extend(block.iter().flat_map(|&value| to_bytes(value)));
        writer.write_all(&bytes)?;
    }
    Ok(())
}
