//! A file of parts: records of many nodes in one file, each node's as a chain of blocks.

use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use crate::{Error, Result};

/// Bytes that all nodes together hold until they are written.
const HELD: usize = 64 << 20;
/// Bytes of a block, at most and at least.
const LARGEST_BLOCK: usize = 1 << 18;
const SMALLEST_BLOCK: usize = 1 << 12;

/// The file; it is gone when it is dropped.
pub(super) struct Spill {
    path: PathBuf,
    file: File,
    end: u64,
    /// Bytes of a record.
    length: usize,
    block: usize,
}

/// The records of a node.
#[derive(Default)]
pub(crate) struct Chain {
    /// Where blocks begin, and their bytes.
    blocks: Vec<(u64, usize)>,
    held: Vec<u8>,
    records: u64,
}

impl Chain {
    pub(super) fn blocks(&self) -> usize {
        self.blocks.len() + 1
    }

    pub(crate) fn records(&self) -> u64 {
        self.records
    }
}

impl Spill {
    pub(super) fn create(path: &Path, length: usize) -> Result<Self> {
        let file = OpenOptions::new().read(true).write(true).create(true).truncate(true).open(path);
        let file = file.map_err(Error::io(path))?;
        Ok(Self { path: path.to_owned(), file, end: 0, length, block: LARGEST_BLOCK })
    }

    /// Shares what may be held among so many nodes.
    pub(super) fn share(&mut self, nodes: usize) {
        self.block = (HELD / nodes.max(1)).clamp(SMALLEST_BLOCK, LARGEST_BLOCK);
    }

    pub(super) fn push(&mut self, chain: &mut Chain, record: &[u8]) -> Result<()> {
        chain.held.extend_from_slice(record);
        chain.records += 1;
        if chain.held.len() + self.length > self.block {
            let fail = Error::io(&self.path);
            self.file.seek(SeekFrom::Start(self.end)).map_err(&fail)?;
            self.file.write_all(&chain.held).map_err(&fail)?;
            chain.blocks.push((self.end, chain.held.len()));
            self.end += chain.held.len() as u64;
            chain.held.clear();
        }
        Ok(())
    }

    /// The block of this number; the last one is what is held.
    pub(super) fn block(&mut self, chain: &Chain, number: usize) -> Result<Vec<u8>> {
        let Some((start, bytes)) = chain.blocks.get(number) else { return Ok(chain.held.clone()) };
        let fail = Error::io(&self.path);
        let mut block = vec![0; *bytes];
        self.file.seek(SeekFrom::Start(*start)).map_err(&fail)?;
        self.file.read_exact(&mut block).map_err(&fail)?;
        Ok(block)
    }
}

impl Drop for Spill {
    fn drop(&mut self) {
        // What is left of it is no result.
        let _ = std::fs::remove_file(&self.path);
    }
}
