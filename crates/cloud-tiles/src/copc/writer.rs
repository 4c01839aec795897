//! Chunks of points, node by node, and the list of nodes behind them.

use std::io::{Read, Seek, SeekFrom, Write};
use std::path::PathBuf;

use atomic_output::FileWriter;
use laz::{LasZipCompressor, LazItemRecordBuilder, LazVlr, LazVlrBuilder};

use super::head::{Written, head, record_behind};
use crate::octree::{Key, Sink};
use crate::record::{Layout, POINT_6};
use crate::{Error, Result};

/// A node in the file.
struct Node {
    key: Key,
    at: u64,
    bytes: u64,
    points: u32,
}

/// A file that grows node by node.
pub(crate) struct CopcWriter<'a> {
    path: PathBuf,
    layout: &'a Layout,
    packing: Vec<u8>,
    packer: LasZipCompressor<'a, FileWriter>,
    /// Where the points begin, with the place of the table of chunks before them.
    start: u64,
    nodes: Vec<Node>,
    points: u64,
}

impl<'a> CopcWriter<'a> {
    /// Begins a file that appears under its name at [`Self::commit`].
    pub(crate) fn create(path: PathBuf, layout: &'a Layout) -> Result<Self> {
        let mut file = FileWriter::create(&path)?;
        let further = (layout.length - POINT_6) as u16;
        let items = LazItemRecordBuilder::default_for_point_format_id(6, further).map_err(packed(&path))?;
        let table: LazVlr = LazVlrBuilder::new(items).with_variable_chunk_size().build();
        let mut packing = Vec::new();
        table.write_to(&mut packing).map_err(Error::io(&path))?;
        let first = head(layout, &packing, &Written::default());
        file.write_all(&first).map_err(Error::io(&path))?;
        let mut packer = LasZipCompressor::new(file, table).map_err(packed(&path))?;
        packer.reserve_offset_to_chunk_table().map_err(Error::io(&path))?;
        let start = first.len() as u64;
        Ok(Self { path, layout, packing, packer, start, nodes: Vec::new(), points: 0 })
    }

    /// Lists the nodes, completes the head and gives the file its name; how many nodes it has.
    pub(crate) fn commit(mut self) -> Result<usize> {
        let path = self.path;
        let fail = Error::io(&path);
        self.packer.done().map_err(&fail)?;
        let mut file = self.packer.into_inner();
        let record_at = file.seek(SeekFrom::End(0)).map_err(&fail)?;
        // The last chunk ends where the table of chunks begins.
        file.seek(SeekFrom::Start(self.start)).map_err(&fail)?;
        let mut table = [0; 8];
        file.read_exact(&mut table).map_err(&fail)?;
        if let Some(last) = self.nodes.last_mut() {
            last.bytes = u64::from_le_bytes(table) - last.at;
        }
        let nodes: Vec<u8> = self.nodes.iter().flat_map(listed).collect();
        let nodes_bytes = nodes.len() as u64;
        let behind = record_behind("copc", 1000, "COPC nodes", nodes_bytes);
        let nodes_at = record_at + behind.len() as u64;
        file.seek(SeekFrom::Start(record_at)).map_err(&fail)?;
        file.write_all(&behind).and_then(|()| file.write_all(&nodes)).map_err(&fail)?;
        let written = Written { nodes_at, nodes_bytes, record_at, points: self.points };
        file.seek(SeekFrom::Start(0)).map_err(&fail)?;
        file.write_all(&head(self.layout, &self.packing, &written)).map_err(&fail)?;
        file.commit()?;
        Ok(self.nodes.len())
    }
}

impl Sink for CopcWriter<'_> {
    fn node(&mut self, key: Key, records: &[u8]) -> Result<()> {
        let fail = Error::io(&self.path);
        // The packer ends a chunk where the next one begins, and the last one by itself.
        if let Some(last) = self.nodes.last_mut() {
            self.packer.finish_current_chunk().map_err(&fail)?;
            last.bytes = self.packer.get_mut().stream_position().map_err(&fail)? - last.at;
        }
        let at = self.packer.get_mut().stream_position().map_err(&fail)?;
        self.packer.compress_many(records).map_err(&fail)?;
        let points = (records.len() / self.layout.length) as u32;
        self.points += u64::from(points);
        self.nodes.push(Node { key, at, bytes: 0, points });
        Ok(())
    }
}

/// A node in the list.
fn listed(node: &Node) -> Vec<u8> {
    let [x, y, z] = node.key.place;
    let mut bytes: Vec<u8> = [node.key.level, x, y, z].into_iter().flat_map(u32::to_le_bytes).collect();
    bytes.extend(node.at.to_le_bytes());
    bytes.extend((node.bytes as u32).to_le_bytes());
    bytes.extend(node.points.to_le_bytes());
    bytes
}

fn packed(path: &std::path::Path) -> impl Fn(laz::LasZipError) -> Error + '_ {
    |error| Error::Io { path: path.to_owned(), source: std::io::Error::other(error.to_string()) }
}
