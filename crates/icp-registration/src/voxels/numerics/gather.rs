//! Sums over the points of each occupied cell.
//!
//! Chunks of fixed length are summed in the order of the points, each in a small table that stays in the cache; the
//! chunks' cells are then sorted and added up in the order of the chunks. So the bits do not depend on the number of
//! threads, nor on any hash.

use nalgebra::Point3;
use rayon::prelude::*;

use crate::voxels::numerics::FREE;
use crate::voxels::numerics::lattice::{Lattice, key};

/// Points a chunk; fixed, as it decides the order of the sums.
const CHUNK: usize = 8192;
/// Slots of a chunk's table: never more than half of them are taken.
const SLOTS: usize = 2 * CHUNK;

/// What is summed in a cell.
pub(crate) trait Sum: Default + Clone + Send + Sync {
    /// Adds point `index`, which lies at `offset` from the centre of the cell, in units of the cell (-0.5 to 0.5).
    fn add(&mut self, index: usize, offset: [f64; 3], of: &Self::Source<'_>);
    /// Adds the sums of another chunk over the same cell.
    fn merge(&mut self, other: &Self);
    /// What else is known of the points.
    type Source<'a>: Sync;
}

/// Sums over the points of each occupied cell, in ascending order of the cells' keys.
pub(crate) fn gather<S: Sum>(
    points: &[Point3<f64>],
    lattice: &Lattice,
    keep: impl Fn(usize) -> bool + Sync,
    source: &S::Source<'_>,
) -> (Vec<u64>, Vec<S>) {
    let chunks: Vec<Vec<(u64, S)>> = points
        .par_chunks(CHUNK)
        .enumerate()
        .map_init(Table::<S>::default, |table, (number, chunk)| {
            for (i, point) in chunk.iter().enumerate() {
                let index = number * CHUNK + i;
                if keep(index) {
                    table.add(index, lattice.place(point), source);
                }
            }
            table.take()
        })
        .collect();
    merged(&chunks)
}

fn merged<S: Sum>(chunks: &[Vec<(u64, S)>]) -> (Vec<u64>, Vec<S>) {
    let parts = || chunks.iter().flatten();
    // The position breaks ties: parts of one cell stay in the order of the chunks.
    let mut order: Vec<(u64, u32)> = parts().enumerate().map(|(i, (key, _))| (*key, i as u32)).collect();
    order.par_sort_unstable();
    let parts: Vec<&S> = parts().map(|(_, sum)| sum).collect();
    let (mut keys, mut sums) = (Vec::with_capacity(order.len()), Vec::<S>::with_capacity(order.len()));
    for (key, part) in order {
        let part = parts[part as usize];
        match sums.last_mut() {
            Some(last) if keys.last() == Some(&key) => last.merge(part),
            _ => {
                keys.push(key);
                sums.push(part.clone());
            }
        }
    }
    (keys, sums)
}

/// Cells of a chunk in the order in which they were met.
struct Table<S> {
    slots: Vec<u32>,
    cells: Vec<([u32; 3], S)>,
    /// Slot of each cell, for emptying.
    taken: Vec<usize>,
    /// Cell of the point before: neighbours in the cloud mostly share it.
    last: usize,
}

impl<S> Default for Table<S> {
    fn default() -> Self {
        Self { slots: vec![FREE; SLOTS], cells: Vec::new(), taken: Vec::new(), last: usize::MAX }
    }
}

impl<S: Sum> Table<S> {
    #[inline]
    fn add(&mut self, index: usize, place: [f64; 3], source: &S::Source<'_>) {
        // The lattice makes places positive and below 2^21: the conversion is the floor.
        let cell = place.map(|v| v as u32);
        let offset = [0, 1, 2].map(|k| place[k] - f64::from(cell[k]) - 0.5);
        if self.cells.get(self.last).is_none_or(|(found, _)| *found != cell) {
            self.last = self.find(cell);
        }
        self.cells[self.last].1.add(index, offset, source);
    }

    fn find(&mut self, cell: [u32; 3]) -> usize {
        let mut slot = hash(cell) & (SLOTS - 1);
        loop {
            let found = self.slots[slot];
            if found == FREE {
                self.slots[slot] = self.cells.len() as u32;
                self.taken.push(slot);
                self.cells.push((cell, S::default()));
                return self.cells.len() - 1;
            }
            if self.cells[found as usize].0 == cell {
                return found as usize;
            }
            slot = (slot + 1) & (SLOTS - 1);
        }
    }

    /// The cells with their keys; the table is empty afterwards.
    fn take(&mut self) -> Vec<(u64, S)> {
        for slot in self.taken.drain(..) {
            self.slots[slot] = FREE;
        }
        self.last = usize::MAX;
        self.cells.drain(..).map(|(cell, sum)| (key(cell), sum)).collect()
    }
}

fn hash(cell: [u32; 3]) -> usize {
    let packed = u64::from(cell[0]) | u64::from(cell[1]) << 21 | u64::from(cell[2]) << 42;
    (packed.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) as usize
}
