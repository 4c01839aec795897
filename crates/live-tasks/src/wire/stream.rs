//! Frames out of a stream of bytes.

use std::io::{ErrorKind, Read};
use std::time::Instant;

use range_image::Samples;

use super::error::{FrameError, Result};
use super::header::{FrameHeader, SampleType};

/// Bytes that are read and turned into samples at a time: memory follows what came, not what a header promises.
const BLOCK: usize = 1 << 16;

/// One frame with its samples, `[F, N, H, W]`.
#[derive(Debug, Clone, PartialEq)]
pub struct LiveFrame {
    /// What the camera said of it.
    pub header: FrameHeader,
    /// Its samples.
    pub samples: Samples,
    /// When it was there as a whole; latency counts from here.
    pub arrived: Instant,
}

/// Reader of frames that follow each other in a stream of bytes.
#[derive(Debug)]
pub struct FrameStream<R> {
    reader: R,
    position: u64,
    block: Vec<u8>,
}

impl<R: Read> FrameStream<R> {
    /// A stream from its beginning.
    pub fn new(reader: R) -> Self {
        Self { reader, position: 0, block: vec![0; BLOCK] }
    }

    /// Bytes that were read.
    pub fn position(&self) -> u64 {
        self.position
    }

    /// Reads the next frame; `None` where the stream ends between two. The memory of `used`, an earlier frame, is used again.
    ///
    /// # Errors
    /// Any [`FrameError`]. The stream cannot be read further then: where the next frame begins is not known.
    pub fn next_frame(&mut self, used: Option<LiveFrame>) -> Result<Option<LiveFrame>> {
        let begin = self.position;
        let mut bytes = [0; FrameHeader::BYTES];
        match fill(&mut self.reader, &mut self.position, &mut bytes)? {
            0 => return Ok(None),
            FrameHeader::BYTES => {}
            found => {
                let (missing, length) = ((FrameHeader::BYTES - found) as u64, FrameHeader::BYTES as u64);
                return Err(FrameError::CutOff { position: self.position, missing, length });
            }
        }
        let header = FrameHeader::parse(&bytes, begin)?;
        let samples = self.samples(&header, used.map(|frame| frame.samples))?;
        Ok(Some(LiveFrame { header, samples, arrived: Instant::now() }))
    }

    /// Refuses further bytes, in a file that holds one frame.
    pub(crate) fn require_end(&mut self) -> Result<()> {
        let position = self.position;
        match fill(&mut self.reader, &mut self.position, &mut [0])? {
            0 => Ok(()),
            _ => Err(FrameError::MoreThanOne { position }),
        }
    }

    fn samples(&mut self, header: &FrameHeader, used: Option<Samples>) -> Result<Samples> {
        Ok(match (header.sample_type, used) {
            (SampleType::U16, Some(Samples::U16(used))) => {
                Samples::U16(self.values(header, used, u16::from_le_bytes)?)
            }
            (SampleType::U16, _) => Samples::U16(self.values(header, Vec::new(), u16::from_le_bytes)?),
            (SampleType::I16, Some(Samples::I16(used))) => {
                Samples::I16(self.values(header, used, i16::from_le_bytes)?)
            }
            (SampleType::I16, _) => Samples::I16(self.values(header, Vec::new(), i16::from_le_bytes)?),
            (SampleType::F32, Some(Samples::F32(used))) => {
                Samples::F32(self.values(header, used, f32::from_le_bytes)?)
            }
            (SampleType::F32, _) => Samples::F32(self.values(header, Vec::new(), f32::from_le_bytes)?),
        })
    }

    /// Reads samples of `N` bytes each, block by block.
    fn values<T, const N: usize>(
        &mut self,
        header: &FrameHeader,
        mut values: Vec<T>,
        value: impl Fn([u8; N]) -> T,
    ) -> Result<Vec<T>> {
        values.clear();
        let (length, begin) = (header.payload(), self.position);
        let Self { reader, position, block } = self;
        let mut missing = length;
        while missing > 0 {
            let wanted = &mut block[..missing.min(BLOCK as u64) as usize];
            let found = fill(reader, position, wanted)?;
            missing -= found as u64;
            if found < wanted.len() {
                return Err(FrameError::CutOff { position: *position, missing, length });
            }
            values.try_reserve(found / N).map_err(|_| FrameError::Memory { position: begin, length })?;
            values.extend(wanted.chunks_exact(N).map(|piece| value(std::array::from_fn(|index| piece[index]))));
        }
        Ok(values)
    }
}

/// Fills `bytes` as far as the stream goes; how many there were.
fn fill(reader: &mut impl Read, position: &mut u64, bytes: &mut [u8]) -> Result<usize> {
    let mut found = 0;
    while found < bytes.len() {
        match reader.read(&mut bytes[found..]) {
            Ok(0) => break,
            Ok(more) => {
                found += more;
                *position += more as u64;
            }
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(source) => return Err(FrameError::Read { position: *position, source }),
        }
    }
    Ok(found)
}
