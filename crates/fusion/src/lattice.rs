//! Cubes of space, numbered, and which of them hold something.

use nalgebra::{Point3, Vector3};

use crate::{Error, Result};

/// Bits of an index along an axis: three make one key.
const BITS: u32 = 21;
/// Free cells around all points, so that neighbours have a key too.
const MARGIN: f64 = 16.0;
/// Beyond this, the position inside a cell is lost to rounding.
const LARGEST_INDEX: f64 = 1e12;

/// Cubes of one size, aligned with the multiples of that size: the same cells whatever else is in the cloud.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lattice {
    pub size_m: f64,
    base: Vector3<f64>,
}

impl Lattice {
    pub fn new<'a>(points: impl Iterator<Item = &'a Point3<f64>>, size_m: f64) -> Result<Self> {
        let start = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        let (low, high) = points.fold(start, |(low, high), p| (low.inf(&p.coords), high.sup(&p.coords)));
        let refused = Error::Cells { voxel_m: size_m, extent_m: (high - low).amax() };
        let base = low.map(|v| (v / size_m).floor() - MARGIN);
        let most = f64::from(1_u32 << BITS) - 2.0 * MARGIN;
        let fits = (0..3).all(|k| {
            low[k].abs() / size_m < LARGEST_INDEX
                && high[k].abs() / size_m < LARGEST_INDEX
                && high[k] / size_m - base[k] < most
        });
        if fits { Ok(Self { size_m, base }) } else { Err(refused) }
    }

    /// The key of the cell of a point; of points far outside, that of a cell at the margin.
    pub fn key(&self, point: &Point3<f64>) -> u64 {
        let place = (point.coords / self.size_m - self.base).map(|v| v.clamp(8.0, 2_097_143.0) as u64);
        place.x | place.y << BITS | place.z << (2 * BITS)
    }

    /// The key of the cell of twice the size, in a numbering of its own.
    pub fn doubled(key: u64) -> u64 {
        let mask = (1_u64 << BITS) - 1;
        let half = |place: u64| (place & mask) >> 1;
        half(key) | half(key >> BITS) << BITS | half(key >> (2 * BITS)) << (2 * BITS)
    }

    /// The centre of a cell.
    pub fn centre(&self, key: u64) -> Point3<f64> {
        let mask = (1_u64 << BITS) - 1;
        let place = Vector3::new(key & mask, (key >> BITS) & mask, key >> (2 * BITS)).map(|v| v as f64 + 0.5);
        Point3::from((place + self.base) * self.size_m)
    }
}

/// Differences of keys to the cells at most `reach` (at most 8) away along each axis, the cell itself among them.
pub(crate) fn neighbours(reach: i64) -> Vec<i64> {
    let range = || -reach..=reach;
    range().flat_map(|z| range().flat_map(move |y| range().map(move |x| x + (y << BITS) + (z << (2 * BITS))))).collect()
}

/// The key of a neighbour.
#[inline]
pub(crate) fn neighbour(key: u64, difference: i64) -> u64 {
    key.wrapping_add_signed(difference)
}

/// Items in runs of equal keys, found by key.
#[derive(Debug)]
pub(crate) struct Runs {
    pub keys: Vec<u64>,
    starts: Vec<u32>,
    /// Open addressing: number of the run, or `FREE`.
    slots: Vec<u32>,
}

const FREE: u32 = u32::MAX;

impl Runs {
    /// Of keys in ascending order, one an item.
    pub fn new(keys_of_items: impl Iterator<Item = u64>) -> Self {
        let (mut keys, mut starts, mut count) = (Vec::new(), Vec::new(), 0_u32);
        for key in keys_of_items {
            if keys.last() != Some(&key) {
                keys.push(key);
                starts.push(count);
            }
            count += 1;
        }
        starts.push(count);
        let mut slots = vec![FREE; (2 * keys.len()).next_power_of_two().max(2)];
        for (at, key) in keys.iter().enumerate() {
            let mut slot = hash(*key) & (slots.len() - 1);
            while slots[slot] != FREE {
                slot = (slot + 1) & (slots.len() - 1);
            }
            slots[slot] = at as u32;
        }
        Self { keys, starts, slots }
    }

    /// The run of a key.
    #[inline]
    pub fn find(&self, key: u64) -> Option<usize> {
        let mut slot = hash(key) & (self.slots.len() - 1);
        loop {
            let found = self.slots[slot];
            if found == FREE {
                return None;
            }
            if self.keys[found as usize] == key {
                return Some(found as usize);
            }
            slot = (slot + 1) & (self.slots.len() - 1);
        }
    }

    /// The items of a run.
    #[inline]
    pub fn items(&self, run: usize) -> std::ops::Range<usize> {
        self.starts[run] as usize..self.starts[run + 1] as usize
    }

    /// The items of a key.
    pub fn of(&self, key: u64) -> std::ops::Range<usize> {
        self.find(key).map_or(0..0, |run| self.items(run))
    }
}

fn hash(key: u64) -> usize {
    let product = key.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    // The upper index of a cell reaches the upper bits only.
    (product ^ (product >> 32)) as usize
}
