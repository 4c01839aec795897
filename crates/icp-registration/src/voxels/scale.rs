//! The size of voxels that suits a cloud.
//!
//! Surfaces fill cells in proportion to the square of their fineness, so counts in one coarse lattice tell how many
//! voxels of any size there are, and how many points the voxel of a typical point holds. Scans from one place are dense
//! near it: the typical point counts, not the typical voxel.

use nalgebra::Point3;
use point_cloud::middle_and_radius;

use super::numerics::gather::gather;
use super::numerics::lattice::{Bounds, CELLS, Lattice};
use super::numerics::moments::Moments;
use crate::error::Result;

/// Points looked at.
const SAMPLE: usize = 16_384;
/// Most voxels: enough for a pose that noise limits, few enough to be fast.
const MOST_VOXELS: f64 = 10_000.0;
/// Points wanted in the voxel of a typical point.
const POINTS_A_VOXEL: f64 = 8.0;
/// Cells across the radius of the lattice that is counted in.
const PROBES: f64 = 10.0;
/// Points that the cell of a typical point must hold in the sample.
const POINTS_A_PROBE: f64 = 6.0;

/// Edge of the voxels, metre: the voxel of a typical point holds about eight, but there are at most about 10 000 voxels.
pub(crate) fn voxel_size(points: &[Point3<f64>], (low, high): &Bounds) -> Result<f64> {
    let sample: Vec<Point3<f64>> = points.iter().copied().step_by(points.len().div_ceil(SAMPLE).max(1)).collect();
    let (radius, extent) = (middle_and_radius(&sample, SAMPLE).1, (high - low).amax());
    if extent <= 0.0 {
        // All points in one place: any size will do.
        return Ok(1.0);
    }
    // Where most points lie in one place, cells are still so large that their indices fit.
    let smallest = 2.0 * extent / CELLS;
    let mut probe = (radius / PROBES).max(smallest);
    let mut counts = counted(&sample, probe)?;
    while typical(&counts) < POINTS_A_PROBE && probe < extent {
        probe *= 2.0;
        counts = counted(&sample, probe)?;
    }
    let thinning = points.len() as f64 / sample.len() as f64;
    let by_points = POINTS_A_VOXEL / (typical(&counts) * thinning);
    let by_voxels = counts.len() as f64 / MOST_VOXELS;
    Ok((probe * by_points.max(by_voxels).sqrt()).max(smallest))
}

/// Points in the cell of the typical point.
fn typical(counts: &[f64]) -> f64 {
    let mut sorted = counts.to_vec();
    sorted.sort_by(f64::total_cmp);
    let half = 0.5 * sorted.iter().sum::<f64>();
    let mut before = 0.0;
    sorted
        .into_iter()
        .find(|count| {
            before += count;
            before >= half
        })
        .unwrap_or(1.0)
}

/// Points in each occupied cell.
fn counted(sample: &[Point3<f64>], size_m: f64) -> Result<Vec<f64>> {
    let lattice = Lattice::new(sample, size_m)?;
    Ok(gather::<Moments>(sample, &lattice, |_| true, &()).1.into_iter().map(|moments| moments.count).collect())
}
