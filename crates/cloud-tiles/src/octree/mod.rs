//! Points into an octree: each node keeps the first point in each cell of a grid, and hands the others on to its children.
//!
//! Where the points of a node fit into memory, it is built there (`within`). Where they do not, they go once through the nodes of the
//! next levels (`beyond`), which keep what is theirs, and end in files of the nodes below, which are built one after the other. Both give
//! the same nodes with the same points in the same order, so that the memory that is allowed changes nothing.

mod beyond;
mod key;
mod spill;
mod within;

use std::path::Path;

pub(crate) use key::{GRID_BITS, Key};
pub(crate) use spill::Chain;
use spill::Spill;

use crate::Result;

/// Points from which on a node keeps a part of them alone.
pub(crate) const LEAF: usize = 50_000;

/// Takes the points of a node, record by record.
pub(crate) trait Sink {
    fn node(&mut self, key: Key, records: &[u8]) -> Result<()>;
}

/// Is shown a record.
pub(crate) type See<'a> = dyn FnMut(&[u8]) -> Result<()> + 'a;
/// Shows all records.
pub(crate) type Each<'a> = dyn Fn(&mut See<'_>) -> Result<()> + 'a;

/// Where points come from.
pub(crate) enum Source<'a> {
    /// Shows all records, as often as it is asked.
    Stream { records: u64, each: &'a Each<'a> },
    /// Those of a part, in the file of parts.
    Chain(Chain),
}

/// An octree on its way to a sink.
pub(crate) struct Octree<'a> {
    sink: &'a mut dyn Sink,
    spill: Spill,
    /// Bytes of a record.
    length: usize,
    /// Binary digits of the coordinates of the whole.
    bits: u32,
    /// Points that may be in memory.
    most: u64,
}

impl<'a> Octree<'a> {
    /// For records of so many bytes; `spill` is a file that is there while it works.
    pub(crate) fn new(sink: &'a mut dyn Sink, spill: &Path, (length, bits): (usize, u32), most: u64) -> Result<Self> {
        Ok(Self { sink, spill: Spill::create(spill, length)?, length, bits, most })
    }

    /// Hands all nodes to the sink, each before its children.
    pub(crate) fn build(&mut self, key: Key, source: &Source<'_>) -> Result<()> {
        let records = match source {
            Source::Stream { records, .. } => *records,
            Source::Chain(chain) => chain.records(),
        };
        // What lies in one cell of the finest grid can't be parted.
        if records > self.most && key.is_parted(self.bits) {
            return self.beyond(key, source);
        }
        let all = self.all(records, source)?;
        self.within(key, &all)
    }

    /// Shows all records, with the file of parts, into which they may go.
    fn each(&mut self, source: &Source<'_>, see: &mut dyn FnMut(&mut Spill, &[u8]) -> Result<()>) -> Result<()> {
        let spill = &mut self.spill;
        match source {
            Source::Stream { each, .. } => each(&mut |record| see(spill, record)),
            Source::Chain(chain) => (0..chain.blocks()).try_for_each(|number| {
                let block = spill.block(chain, number)?;
                block.chunks_exact(self.length).try_for_each(|record| see(spill, record))
            }),
        }
    }

    /// All records of a source.
    fn all(&mut self, records: u64, source: &Source<'_>) -> Result<Vec<u8>> {
        let mut all = Vec::with_capacity(records as usize * self.length);
        self.each(source, &mut |_, record| {
            all.extend_from_slice(record);
            Ok(())
        })?;
        Ok(all)
    }
}
