//! A reader of what is written, by the specification, with nothing of the writer.

use std::collections::BTreeMap;
use std::fs::read;
use std::io::Cursor;
use std::path::Path;

use laz::LazVlr;
use laz::record::{LayeredPointRecordDecompressor, RecordDecompressor};

/// A file with its nodes.
pub struct Copc {
    bytes: Vec<u8>,
    pub length: usize,
    pub step: f64,
    pub origin: [f64; 3],
    pub points: u64,
    pub centre: [f64; 3],
    pub half: f64,
    pub names: Vec<String>,
    vlr: LazVlr,
    /// By level and place: where, how many bytes, how many points.
    pub nodes: BTreeMap<[i32; 4], (u64, usize, usize)>,
}

impl Copc {
    pub fn open(path: &Path) -> Self {
        let bytes = read(path).unwrap();
        let u16_at = |at: usize| u16::from_le_bytes(bytes[at..at + 2].try_into().unwrap());
        let u32_at = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        let u64_at = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
        let f64_at = |at: usize| f64::from_bits(u64_at(at));
        assert_eq!((&bytes[..4], &bytes[24..26], bytes[104]), (&b"LASF"[..], &[1, 4][..], 0x86));
        let length = usize::from(u16_at(105));
        let (mut at, mut names, mut vlr) = (usize::from(u16_at(94)), Vec::new(), None);
        // The first record is COPC's, at a place that readers know.
        assert_eq!((&bytes[at + 2..at + 6], u16_at(at + 18), u16_at(at + 20)), (&b"copc"[..], 1, 160));
        let info = at + 54;
        for _ in 0..u32_at(100) {
            let (number, size) = (u16_at(at + 18), usize::from(u16_at(at + 20)));
            let content = &bytes[at + 54..at + 54 + size];
            match number {
                22204 => vlr = Some(LazVlr::from_buffer(content).unwrap()),
                4 => names.extend(
                    content
                        .chunks(192)
                        .map(|value| String::from_utf8_lossy(&value[4..36]).trim_end_matches('\0').to_owned()),
                ),
                _ => {}
            }
            at += 54 + size;
        }
        assert_eq!(at, u32_at(96) as usize, "points begin behind the records");
        assert_eq!(u64_at(235) + 60, u64_at(info + 40), "nodes stand in the record behind the points");
        let (first, size) = (u64_at(info + 40) as usize, u64_at(info + 48) as usize);
        assert_eq!(first + size, bytes.len());
        let nodes = bytes[first..].chunks(32).map(|node| {
            let i32_at = |at: usize| i32::from_le_bytes(node[at..at + 4].try_into().unwrap());
            let place = u64::from_le_bytes(node[16..24].try_into().unwrap());
            ([0, 4, 8, 12].map(i32_at), (place, i32_at(24) as usize, i32_at(28) as usize))
        });
        Self {
            length,
            step: f64_at(131),
            origin: [155, 163, 171].map(f64_at),
            points: u64_at(247),
            centre: [info, info + 8, info + 16].map(f64_at),
            half: f64_at(info + 24),
            names,
            vlr: vlr.unwrap(),
            nodes: nodes.collect(),
            bytes,
        }
    }

    /// The records of a node, from its place in the file alone.
    pub fn records(&self, (at, bytes, points): (u64, usize, usize)) -> Vec<u8> {
        let chunk = &self.bytes[at as usize..at as usize + bytes];
        let mut decompressor = LayeredPointRecordDecompressor::new(Cursor::new(chunk));
        decompressor.set_fields_from(self.vlr.items()).unwrap();
        let mut records = vec![0; points * self.length];
        for record in records.chunks_exact_mut(self.length) {
            decompressor.decompress_next(record).unwrap();
        }
        records
    }

    pub fn place(&self, record: &[u8]) -> [f64; 3] {
        [0, 1, 2].map(|axis| {
            let whole = i32::from_le_bytes(record[4 * axis..4 * axis + 4].try_into().unwrap());
            self.origin[axis] + self.step * f64::from(whole)
        })
    }
}

/// A PLY of points `x y z intensity sigma flags frame` with a deviation and a frame that tell each point from all others.
pub fn ply(path: &Path, points: &[[f32; 3]]) {
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\ncomment metres\nelement vertex {}\nproperty float x\nproperty float y\nproperty \
         float z\nproperty float intensity\nproperty float sigma\nproperty ushort flags\nproperty uint frame\nend_header\n",
        points.len()
    )
    .into_bytes();
    for (index, point) in (0_u32..).zip(points) {
        for x in point {
            bytes.extend(x.to_le_bytes());
        }
        bytes.extend((1.0 + index as f32).to_le_bytes());
        bytes.extend((1e-3 * index as f32).to_le_bytes());
        bytes.extend((u16::from(index.is_multiple_of(5)) << 3).to_le_bytes());
        bytes.extend(index.to_le_bytes());
    }
    std::fs::write(path, bytes).unwrap();
}
