//! Where a point lies in a lattice of cubes, and the order in which cubes are kept.

use nalgebra::{Point3, Vector3};

use crate::error::{Error, Result};

/// Cells along an axis: three indices of 21 bit make one key.
pub(crate) const CELLS: f64 = 2_097_152.0;
/// Free cells below the smallest index, so that neighbours have an index too; a multiple of every level's cell.
const MARGIN: f64 = 256.0;
/// Beyond this, the position inside a cell is lost to rounding.
const LARGEST_INDEX: f64 = 1e13;

/// Cubes of one size, aligned with the multiples of that size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Lattice {
    pub size_m: f64,
    inverse: f64,
    base: [f64; 3],
}

impl Lattice {
    /// A lattice that has an index for every one of `points` (all finite, at least one).
    ///
    /// # Errors
    /// [`Error::VoxelSize`] for a size that is not positive, or so small that the indices overflow.
    pub fn new(points: &[Point3<f64>], size_m: f64) -> Result<Self> {
        Self::within(&bounds(points), size_m)
    }

    /// As [`Lattice::new`] for points within known bounds.
    pub fn within(&(low, high): &Bounds, size_m: f64) -> Result<Self> {
        let extent_m = (high - low).amax();
        let refused = Error::VoxelSize { voxel_m: size_m, extent_m };
        let inverse = 1.0 / size_m;
        if !(size_m > 0.0 && size_m.is_finite() && inverse > 0.0 && inverse.is_finite()) {
            return Err(refused);
        }
        let base = low.map(|v| (v * inverse).floor() - MARGIN);
        let fits = (0..3).all(|k| {
            let last = high[k] * inverse - base[k];
            low[k].abs() * inverse < LARGEST_INDEX && high[k].abs() * inverse < LARGEST_INDEX && last < CELLS - MARGIN
        });
        if fits { Ok(Self { size_m, inverse, base: base.into() }) } else { Err(refused) }
    }

    /// Position in units of cells, counted from the lattice's corner: positive for the points it was made for.
    #[inline]
    pub fn place(&self, point: &Point3<f64>) -> [f64; 3] {
        [
            point.x * self.inverse - self.base[0],
            point.y * self.inverse - self.base[1],
            point.z * self.inverse - self.base[2],
        ]
    }

    /// The point at a position in units of cells.
    pub fn point(&self, place: &[f64; 3]) -> Point3<f64> {
        Point3::from(Vector3::from_fn(|k, _| (place[k] + self.base[k]) * self.size_m))
    }
}

/// Smallest and largest coordinates.
pub(crate) type Bounds = (Vector3<f64>, Vector3<f64>);

pub(crate) fn bounds(points: &[Point3<f64>]) -> Bounds {
    let start = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    points.iter().fold(start, |(low, high), p| (low.inf(&p.coords), high.sup(&p.coords)))
}

/// Key of a cell: the bits of the three indices in turn (Morton order), so that the eight cells of a cell of the next
/// level lie beside each other.
pub(crate) fn key(cell: [u32; 3]) -> u64 {
    spread(cell[0]) | spread(cell[1]) << 1 | spread(cell[2]) << 2
}

/// The indices of a key.
pub(crate) fn cell(key: u64) -> [u32; 3] {
    [gather(key), gather(key >> 1), gather(key >> 2)]
}

/// Every third bit from the 21 lowest.
fn spread(v: u32) -> u64 {
    let mut x = u64::from(v) & 0x1f_ffff;
    x = (x | x << 32) & 0x001f_0000_0000_ffff;
    x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

fn gather(key: u64) -> u32 {
    let mut x = key & 0x1249_2492_4924_9249;
    x = (x | x >> 2) & 0x10c3_0c30_c30c_30c3;
    x = (x | x >> 4) & 0x100f_00f0_0f00_f00f;
    x = (x | x >> 8) & 0x001f_0000_ff00_00ff;
    x = (x | x >> 16) & 0x001f_0000_0000_ffff;
    x = (x | x >> 32) & 0x1f_ffff;
    x as u32
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn keys_keep_the_indices(cell_of in prop::array::uniform3(0_u32..1 << 21)) {
            prop_assert_eq!(cell(key(cell_of)), cell_of);
            prop_assert_eq!(cell(key(cell_of) >> 3), cell_of.map(|c| c >> 1));
        }

        #[test]
        fn points_return_from_their_place(p in prop::array::uniform3(-1e3..1e3_f64), size in 0.01..10.0_f64) {
            let points = [Point3::from(p), Point3::origin()];
            let lattice = Lattice::new(&points, size).unwrap();
            // Rounding of coordinates up to 1e3.
            prop_assert!((lattice.point(&lattice.place(&points[0])) - points[0]).norm() < 1e-11);
            prop_assert!(lattice.place(&points[0]).iter().all(|v| (MARGIN..CELLS).contains(v)));
        }
    }

    #[test]
    fn sizes_that_overflow_are_refused() {
        let points = [Point3::origin(), Point3::new(1e6, 0.0, 0.0)];
        for size in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-320, 1e-9, 0.1] {
            assert!(matches!(Lattice::new(&points, size), Err(Error::VoxelSize { .. })), "{size}");
        }
        assert!(Lattice::new(&points, 1.0).is_ok());
        // One point far away: no extent, but no digits left inside a cell.
        assert!(matches!(Lattice::new(&[Point3::new(1e30, 0.0, 0.0)], 1.0), Err(Error::VoxelSize { .. })));
    }
}
