//! The file that is read: where reading stands, and how much is left.

use std::io::{self, BufReader, Read, Seek, SeekFrom};

/// What a recording can be read from.
pub(crate) trait ReadSeek: Read + Seek + Send {}

impl<T: Read + Seek + Send> ReadSeek for T {}

/// A source of known length. Nothing is allocated that it cannot fill.
pub(crate) struct Input {
    reader: BufReader<Box<dyn ReadSeek>>,
    position: u64,
    length: u64,
}

#[cfg_attr(not(all(feature = "mcap", feature = "bag", feature = "mkv", feature = "adi")), allow(dead_code))]
impl Input {
    pub fn new(mut source: Box<dyn ReadSeek>) -> io::Result<Self> {
        let length = source.seek(SeekFrom::End(0))?;
        source.rewind()?;
        Ok(Self { reader: BufReader::with_capacity(1 << 16, source), position: 0, length })
    }

    pub fn position(&self) -> u64 {
        self.position
    }

    pub fn length(&self) -> u64 {
        self.length
    }

    /// Bytes from here to the end.
    pub fn left(&self) -> u64 {
        self.length.saturating_sub(self.position)
    }

    pub fn seek(&mut self, to: u64) -> io::Result<()> {
        let to = to.min(self.length);
        // Both are places within a file, whose length is an i64.
        self.reader.seek_relative(to as i64 - self.position as i64)?;
        self.position = to;
        Ok(())
    }

    /// Steps over bytes, to the end at most.
    pub fn skip(&mut self, bytes: u64) -> io::Result<()> {
        self.seek(self.position.saturating_add(bytes))
    }

    /// The next `count` bytes, which the caller knows to be there.
    pub fn bytes(&mut self, count: u64) -> io::Result<Vec<u8>> {
        if count > self.left() {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        let mut bytes = zeros(count as usize)?;
        self.fill(&mut bytes)?;
        Ok(bytes)
    }

    pub fn array<const N: usize>(&mut self) -> io::Result<[u8; N]> {
        let mut bytes = [0; N];
        self.fill(&mut bytes)?;
        Ok(bytes)
    }

    /// As many of the next bytes as there are, `count` at most, without stepping over them.
    pub fn peek(&mut self, count: u64) -> io::Result<Vec<u8>> {
        let start = self.position;
        let bytes = self.bytes(count.min(self.left()))?;
        self.seek(start)?;
        Ok(bytes)
    }

    fn fill(&mut self, bytes: &mut [u8]) -> io::Result<()> {
        self.reader.read_exact(bytes)?;
        self.position += bytes.len() as u64;
        Ok(())
    }
}

/// As many zero bytes, or the error of a machine without memory.
pub(crate) fn zeros(count: usize) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(count).map_err(|_| io::Error::from(io::ErrorKind::OutOfMemory))?;
    bytes.resize(count, 0);
    Ok(bytes)
}
