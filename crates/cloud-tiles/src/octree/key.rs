//! Nodes of an octree over whole coordinates.

/// Binary digits of the cells of a node along an axis: 128, of which surfaces fill some tens of thousands.
pub(crate) const GRID_BITS: u32 = 7;
const CELLS: usize = 1 << (3 * GRID_BITS);

/// A node: its level, and its place among those of its level.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub(crate) struct Key {
    pub(crate) level: u32,
    pub(crate) place: [u32; 3],
}

/// The cells of a node that have a point.
pub(crate) struct Cells(Vec<u64>);

impl Key {
    /// The node of a level above the place that lies in it.
    pub(crate) fn containing(place: [u32; 3], level: u32, bits: u32) -> Self {
        Self { level, place: place.map(|x| x.checked_shr(bits.saturating_sub(level)).unwrap_or(0)) }
    }

    /// One of its eight children.
    pub(crate) fn child(self, octant: u32) -> Self {
        let place = [0, 1, 2].map(|axis| 2 * self.place[axis] + (octant >> axis & 1));
        Self { level: self.level + 1, place }
    }

    /// Which of its children a place lies in.
    pub(crate) fn octant(self, place: [u32; 3], bits: u32) -> usize {
        let shift = bits.saturating_sub(self.level + 1);
        (0..3).map(|axis| ((place[axis] >> shift & 1) as usize) << axis).sum()
    }

    /// The cell of its grid that a place lies in.
    pub(crate) fn cell(self, place: [u32; 3], bits: u32) -> usize {
        let shift = bits.saturating_sub(self.level + GRID_BITS);
        let mask = (1 << GRID_BITS) - 1;
        place.iter().fold(0, |cell, x| cell << GRID_BITS | (x >> shift & mask) as usize)
    }

    /// Whether its cells are larger than one step of the coordinates, so that its children tell points apart that it does not.
    pub(crate) fn is_parted(self, bits: u32) -> bool {
        self.level + GRID_BITS < bits
    }
}

impl Cells {
    pub(crate) fn new() -> Self {
        Self(vec![0; CELLS / 64])
    }

    /// Whether nobody has taken the cell before.
    pub(crate) fn take(&mut self, cell: usize) -> bool {
        let (word, bit) = (&mut self.0[cell / 64], 1 << (cell % 64));
        let is_free = *word & bit == 0;
        *word |= bit;
        is_free
    }
}
