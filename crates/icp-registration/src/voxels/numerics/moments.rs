//! First and second moments of the points of a cell: all that a Gaussian needs, and they add.

use nalgebra::Matrix3;

use crate::voxels::numerics::gather::Sum;

/// Sums over offsets from the centre of a cell, in units of that cell: no scale of a cloud leaves the range.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Moments {
    pub count: f64,
    pub sum: [f64; 3],
    /// xx, xy, xz, yy, yz, zz.
    pub products: [f64; 6],
}

const PRODUCTS: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

impl Sum for Moments {
    type Source<'a> = ();

    #[inline]
    fn add(&mut self, _: usize, offset: [f64; 3], (): &()) {
        self.count += 1.0;
        self.sum.iter_mut().zip(offset).for_each(|(sum, value)| *sum += value);
        for (product, (i, j)) in self.products.iter_mut().zip(PRODUCTS) {
            *product += offset[i] * offset[j];
        }
    }

    fn merge(&mut self, other: &Self) {
        self.include(other);
    }
}

impl Moments {
    /// Adds moments about the same centre in the same unit.
    #[inline]
    pub fn include(&mut self, other: &Self) {
        self.count += other.count;
        self.sum.iter_mut().zip(other.sum).for_each(|(sum, value)| *sum += value);
        self.products.iter_mut().zip(other.products).for_each(|(sum, value)| *sum += value);
    }

    /// The same points, all offsets enlarged by `shift`: counted from a centre that lies at `-shift` of this one.
    #[inline]
    pub fn shifted(&self, shift: [f64; 3]) -> Self {
        let mut moved = *self;
        moved.sum.iter_mut().zip(shift).for_each(|(sum, value)| *sum += self.count * value);
        for (product, (i, j)) in moved.products.iter_mut().zip(PRODUCTS) {
            *product += self.sum[i] * shift[j] + self.sum[j] * shift[i] + self.count * shift[i] * shift[j];
        }
        moved
    }

    /// The same points in units of twice the size.
    pub fn in_doubled_units(&self) -> Self {
        Self { count: self.count, sum: self.sum.map(|s| 0.5 * s), products: self.products.map(|p| 0.25 * p) }
    }

    /// Mean offset.
    #[inline]
    pub fn mean(&self) -> [f64; 3] {
        self.sum.map(|s| s / self.count)
    }

    /// Covariance of the points about their mean.
    #[inline]
    pub fn scatter(&self) -> Matrix3<f64> {
        let mean = self.mean();
        let mut about = [0.0; 6];
        for (value, (product, (i, j))) in about.iter_mut().zip(self.products.iter().zip(PRODUCTS)) {
            *value = product / self.count - mean[i] * mean[j];
        }
        let [xx, xy, xz, yy, yz, zz] = about;
        Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_move_and_change_their_unit() {
        let offsets = [[0.1, -0.2, 0.4], [-0.3, 0.2, 0.1], [0.45, 0.0, -0.5]];
        let (mut here, mut there) = (Moments::default(), Moments::default());
        let shift = [0.5, -0.5, 0.5];
        for (index, offset) in offsets.into_iter().enumerate() {
            here.add(index, offset, &());
            there.add(index, [0, 1, 2].map(|k| f64::midpoint(offset[k], shift[k])), &());
        }
        let moved = here.shifted(shift).in_doubled_units();
        // Rounding.
        assert!((moved.scatter() - there.scatter()).norm() < 1e-15);
        for k in 0..3 {
            assert!((moved.mean()[k] - there.mean()[k]).abs() < 1e-15);
        }
    }
}
