//! Medians, quantiles and pictures of the pixels of many views, from so many of them as tell these well enough.

/// Values that are kept of one quantity, about: the median of so many is known to a thousandth of a standard deviation, and
/// they take 16 MB. A survey of fewer pixels, 60 frames of 176 x 144, keeps all.
const MOST_VALUES: usize = 1 << 21;

/// Every how many pixels one is kept.
#[derive(Debug, Clone, Copy)]
pub struct Thinning {
    stride: usize,
    /// Views before the first one, which are others' work.
    first: usize,
}

impl Thinning {
    /// Keeps all.
    pub const ALL: Self = Self { stride: 1, first: 0 };

    /// For so many pixels in all views together.
    pub fn of(pixels: usize) -> Self {
        let stride = pixels.div_ceil(MOST_VALUES).max(1);
        // Widths of images are even: an odd stride takes pixels of all columns.
        Self { stride: stride | 1, first: 0 }
    }

    /// Values that are kept of one quantity of so many pixels.
    pub fn kept(self, pixels: usize) -> u64 {
        (pixels / self.stride) as u64
    }

    /// The same where the view of number 0 has so many before it.
    pub fn after(self, first: usize) -> Self {
        Self { first, ..self }
    }

    /// Pixels of the view of this number, of `count` pixels.
    pub fn pixels(self, view: usize, count: usize) -> impl Iterator<Item = usize> {
        ((self.first + view) % self.stride..count).step_by(self.stride)
    }
}
