//! What stands before the points, little-endian throughout.

use crate::record::{Layout, POINT_6};

/// Bytes of the head of the file, and of a record that follows it.
const HEAD: usize = 375;
const RECORD_HEAD: usize = 54;
/// Bytes that describe one further value.
const FURTHER_VALUE: usize = 192;
/// Point format 6, packed.
const FORMAT: u8 = 6 | 0x80;
/// Coordinate systems are told as text; none is here: clouds are in frames of their own.
const TEXT_CRS: u16 = 1 << 4;

/// What is known once all points are written.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Written {
    pub(crate) nodes_at: u64,
    pub(crate) nodes_bytes: u64,
    pub(crate) record_at: u64,
    pub(crate) points: u64,
}

/// All that comes before the points. Its length does not depend on what was written.
pub(crate) fn head(layout: &Layout, packing: &[u8], written: &Written) -> Vec<u8> {
    let further: Vec<u8> = layout.further_values().flat_map(|(name, number)| further_value(name, number)).collect();
    let mut records = record("copc", 1, "COPC info", &info(layout, written));
    let mut count = 2_u32;
    records.extend(record("laszip encoded", 22204, "packing", packing));
    if !further.is_empty() {
        records.extend(record("LASF_Spec", 4, "further values", &further));
        count += 1;
    }
    let start = (HEAD + records.len()) as u32;
    let mut bytes = Vec::with_capacity(start as usize);
    bytes.extend(b"LASF");
    // Source; coordinate system; an identifier of the project, which is none.
    bytes.extend([0, 0]);
    bytes.extend(TEXT_CRS.to_le_bytes());
    bytes.extend([0; 16]);
    bytes.extend([1, 4]);
    bytes.extend(text::<32>("range camera"));
    bytes.extend(text::<32>(concat!("rangecam ", env!("CARGO_PKG_VERSION"))));
    // No date: the same cloud gives the same bytes.
    bytes.extend([0; 4]);
    bytes.extend((HEAD as u16).to_le_bytes());
    bytes.extend(start.to_le_bytes());
    bytes.extend(count.to_le_bytes());
    bytes.push(FORMAT);
    bytes.extend((layout.length as u16).to_le_bytes());
    // Counts of 32 bits, which this format has not.
    bytes.extend([0; 4 + 20]);
    let mut put = |value: f64| bytes.extend(value.to_le_bytes());
    [layout.step_m; 3].into_iter().chain(layout.origin_m).for_each(&mut put);
    for axis in 0..3 {
        put(layout.extent.high[axis]);
        put(layout.extent.low[axis]);
    }
    // Waveforms; where records behind the points begin, and how many.
    bytes.extend(0_u64.to_le_bytes());
    bytes.extend(written.record_at.to_le_bytes());
    bytes.extend(1_u32.to_le_bytes());
    bytes.extend(written.points.to_le_bytes());
    // By return: all are first ones.
    bytes.extend(written.points.to_le_bytes());
    bytes.extend([0; 14 * 8]);
    bytes.extend(records);
    bytes
}

/// Cube and spacing of the octree, and where its nodes are listed.
fn info(layout: &Layout, written: &Written) -> Vec<u8> {
    let half_m = 0.5 * layout.step_m * 2.0_f64.powi(layout.bits as i32);
    let spacing_m = 2.0 * half_m / f64::from(1 << crate::octree::GRID_BITS);
    let numbers = layout.origin_m.map(|origin| origin + half_m).into_iter().chain([half_m, spacing_m]);
    let mut bytes: Vec<u8> = numbers.flat_map(f64::to_le_bytes).collect();
    bytes.extend(written.nodes_at.to_le_bytes());
    bytes.extend(written.nodes_bytes.to_le_bytes());
    // First and last time, which points do not have, and what is reserved.
    bytes.extend([0; 16 + 88]);
    bytes
}

/// A record before the points.
fn record(user: &str, number: u16, words: &str, bytes: &[u8]) -> Vec<u8> {
    let mut all = Vec::with_capacity(RECORD_HEAD + bytes.len());
    all.extend([0, 0]);
    all.extend(text::<16>(user));
    all.extend(number.to_le_bytes());
    all.extend((bytes.len() as u16).to_le_bytes());
    all.extend(text::<32>(words));
    all.extend(bytes);
    all
}

/// The head of a record behind the points.
pub(crate) fn record_behind(user: &str, number: u16, words: &str, bytes: u64) -> Vec<u8> {
    let mut all = vec![0, 0];
    all.extend(text::<16>(user));
    all.extend(number.to_le_bytes());
    all.extend(bytes.to_le_bytes());
    all.extend(text::<32>(words));
    all
}

/// A value that LAS has no field for.
fn further_value(name: &str, number: u8) -> Vec<u8> {
    let words = match name {
        "amplitude" => "unit of the camera",
        "sigma" => "deviation, metre",
        "sigma_own" => "own part of it, metre",
        "flags" => "bits of pixel flags",
        "frame" => "frame of the result",
        _ => "",
    };
    let mut bytes = vec![0; FURTHER_VALUE];
    bytes[2] = number;
    bytes[4..36].copy_from_slice(&text::<32>(name));
    bytes[160..].copy_from_slice(&text::<32>(words));
    bytes
}

/// Letters, filled up with zeros.
fn text<const N: usize>(words: &str) -> [u8; N] {
    let mut bytes = [0; N];
    bytes.iter_mut().zip(words.bytes()).for_each(|(to, from)| *to = from);
    bytes
}

const _: () = assert!(POINT_6 == 30, "format 6");
