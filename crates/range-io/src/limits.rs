//! Bounds that guard what is allocated on a header's word.

/// Larger images than any range camera's.
pub(crate) const MOST_PIXELS: usize = 1 << 26;
