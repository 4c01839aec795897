//! Integer cells of space and a table from cells to numbers, in the order of first use.

/// Half of the cells that an axis has: 21 bits with sign.
const HALF_RANGE: f32 = (1 << 20) as f32 - 2.0;
const EMPTY: u64 = u64::MAX;
const BITS: u32 = 21;
const MASK: u64 = (1 << BITS) - 1;

/// The three indices of a cell in one number; `None` beyond a million cells from the origin (or for NaN).
#[inline]
pub(super) fn key_of(point: [f32; 3], per_cell: f32) -> Option<u64> {
    let [x, y, z] = [point[0] * per_cell, point[1] * per_cell, point[2] * per_cell];
    // NaN fails the comparison.
    if !(x.abs() <= HALF_RANGE && y.abs() <= HALF_RANGE && z.abs() <= HALF_RANGE) {
        return None;
    }
    // Rounding down without a call of the library, which machines without that instruction need.
    let index = |c: f32| {
        let cut = c as i32;
        (cut - i32::from(cut as f32 > c) + (1 << 20)) as u64
    };
    Some(index(x) | index(y) << BITS | index(z) << (2 * BITS))
}

/// The cell that lies `step` cells away; keys from [`key_of`] leave a margin of one cell at either end.
#[inline]
pub(super) fn shifted(key: u64, step: [i64; 3]) -> u64 {
    let offset = step[0] + (step[1] << BITS) + (step[2] << (2 * BITS));
    key.wrapping_add_signed(offset)
}

/// Middle of a cell in units of cells.
pub(super) fn middle(key: u64) -> [f32; 3] {
    let index = |shift: u32| (((key >> shift) & MASK) as i32 - (1 << 20)) as f32 + 0.5;
    [index(0), index(BITS), index(2 * BITS)]
}

/// Open addressing with linear probing; values are given by the caller.
#[derive(Debug, Clone)]
pub(super) struct CellTable {
    slots: Vec<(u64, u32)>,
    used: usize,
}

impl CellTable {
    pub(super) fn new(expected: usize) -> Self {
        Self { slots: vec![(EMPTY, 0); (2 * expected).next_power_of_two().max(64)], used: 0 }
    }

    #[inline]
    fn place(&self, key: u64) -> usize {
        let mixed = key.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        (mixed >> (64 - self.slots.len().trailing_zeros())) as usize
    }

    /// Index of the slot that holds the key or may take it.
    #[inline]
    fn probe(&self, key: u64) -> usize {
        let mask = self.slots.len() - 1;
        let mut place = self.place(key);
        while self.slots[place].0 != key && self.slots[place].0 != EMPTY {
            place = (place + 1) & mask;
        }
        place
    }

    #[inline]
    pub(super) fn get(&self, key: u64) -> Option<u32> {
        let (found, value) = self.slots[self.probe(key)];
        (found == key).then_some(value)
    }

    /// The value of the cell, and whether `value` was put in because there was none.
    #[inline]
    pub(super) fn get_or_insert(&mut self, key: u64, value: u32) -> (u32, bool) {
        let place = self.probe(key);
        if self.slots[place].0 == key {
            return (self.slots[place].1, false);
        }
        self.slots[place] = (key, value);
        self.used += 1;
        if 2 * self.used > self.slots.len() {
            self.grow();
        }
        (value, true)
    }

    /// Changes the value of a cell that is there.
    pub(super) fn set(&mut self, key: u64, value: u32) {
        let place = self.probe(key);
        self.slots[place] = (key, value);
    }

    fn grow(&mut self) {
        let slots = vec![(EMPTY, 0); 2 * self.slots.len()];
        let old = std::mem::replace(&mut self.slots, slots);
        for (key, value) in old.into_iter().filter(|slot| slot.0 != EMPTY) {
            let place = self.probe(key);
            self.slots[place] = (key, value);
        }
    }
}
