//! Which voxel lies in a cell: a table of blocks of 4 x 4 x 4 cells.
//!
//! Voxels are sorted by key, so those of a block lie beside each other: a block is a mask of its occupied cells and the
//! index of its first voxel. Tables of a room or a street fit into the cache.

use crate::voxels::numerics::FREE;
use crate::voxels::numerics::lattice::key;

#[derive(Debug, Clone, Copy)]
struct Block {
    key: u64,
    occupied: u64,
    first: u32,
}

/// Blocks in a table with open addressing.
#[derive(Debug, Clone)]
pub(crate) struct Blocks {
    slots: Vec<u32>,
    all: Vec<Block>,
    shift: u32,
}

impl Blocks {
    /// The table of voxels with these keys, ascending and different.
    pub fn new(keys: &[u64]) -> Self {
        let mut blocks: Vec<Block> = Vec::with_capacity(keys.len() / 4 + 1);
        for (index, &key) in keys.iter().enumerate() {
            let bit = 1 << (key & 63);
            match blocks.last_mut() {
                Some(block) if block.key == key >> 6 => block.occupied |= bit,
                _ => blocks.push(Block { key: key >> 6, occupied: bit, first: index as u32 }),
            }
        }
        let size = (2 * blocks.len()).next_power_of_two().max(2);
        let mut table = Self { slots: vec![FREE; size], all: blocks, shift: 64 - size.trailing_zeros() };
        for index in 0..table.all.len() {
            let mut slot = table.slot(table.all[index].key);
            while table.slots[slot] != FREE {
                slot = (slot + 1) & (size - 1);
            }
            table.slots[slot] = index as u32;
        }
        table
    }

    #[inline]
    fn slot(&self, block: u64) -> usize {
        (block.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> self.shift) as usize
    }

    #[inline]
    fn block(&self, key: u64) -> Option<&Block> {
        let mut slot = self.slot(key);
        loop {
            let index = self.slots[slot];
            if index == FREE {
                return None;
            }
            let block = &self.all[index as usize];
            if block.key == key {
                return Some(block);
            }
            slot = (slot + 1) & (self.slots.len() - 1);
        }
    }

    /// Calls `visit` with the number of the cell in the list and the index of its voxel for each occupied cell among
    /// the products of `x`, `y` and `z` indices.
    #[inline]
    pub fn visit<const N: usize>(&self, cells: [[u32; N]; 3], mut visit: impl FnMut(usize, usize)) {
        let [x, y, z] = [0, 1, 2].map(|axis| cells[axis].map(|c| key([c, 0, 0]) << axis));
        // Consecutive cells lie in at most two blocks an axis: each block is looked up once.
        let mut known: [(u64, Option<&Block>); 8] = [(u64::MAX, None); 8];
        for (k, z) in z.iter().enumerate() {
            for (j, y) in y.iter().enumerate() {
                for (i, x) in x.iter().enumerate() {
                    let key = x | y | z;
                    let place = &mut known[(key >> 6 & 7) as usize];
                    if place.0 != key >> 6 {
                        *place = (key >> 6, self.block(key >> 6));
                    }
                    if let Some(block) = place.1 {
                        let bit = 1_u64 << (key & 63);
                        if block.occupied & bit != 0 {
                            let before = (block.occupied & (bit - 1)).count_ones();
                            visit((k * N + j) * N + i, (block.first + before) as usize);
                        }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn cells_are_found_where_they_are(cells in prop::collection::btree_set([0_u32..9, 0_u32..9, 0_u32..9], 1..200)) {
            let mut keys: Vec<u64> = cells.iter().map(|c| key(*c)).collect();
            keys.sort_unstable();
            let blocks = Blocks::new(&keys);
            let all = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9];
            let mut found = Vec::new();
            blocks.visit([all; 3], |place, index| {
                let cell = [place % 10, place / 10 % 10, place / 100].map(|c| c as u32);
                assert_eq!(keys[index], key(cell));
                found.push(cell);
            });
            found.sort_unstable();
            prop_assert_eq!(found, cells.into_iter().collect::<Vec<_>>());
        }
    }
}
