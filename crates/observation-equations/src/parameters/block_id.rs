/// Names a parameter block of one adjustment: its number in the order of adding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct BlockId(usize);

impl BlockId {
    /// The block of this number, from 0. Adjustments give the numbers of their blocks; others name blocks of a list.
    #[inline]
    pub fn new(index: usize) -> Self {
        Self(index)
    }

    /// Number of the block, in the order of adding, from 0.
    #[inline]
    pub fn index(self) -> usize {
        self.0
    }
}
