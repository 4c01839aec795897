//! The size of voxels that suits a cloud.

use nalgebra::Point3;

use super::gather::{Sum, gather};
use super::lattice::Lattice;
use crate::error::Result;
use crate::kernel::quantile;

/// Points looked at.
const SAMPLE: usize = 16_384;
/// Voxels wanted: enough for a pose that noise limits, few enough to be fast.
const MOST_VOXELS: f64 = 10_000.0;
/// Points wanted in a voxel where there are fewer points than fill so many voxels.
const POINTS_A_VOXEL: f64 = 8.0;
/// Cells across the radius of the lattice that the area is measured with.
const PROBES: f64 = 10.0;
/// Points that a cell of that lattice must hold on average for its cells to be counted completely.
const POINTS_A_PROBE: usize = 4;
/// Share of the extent below which indices could overflow.
const SMALLEST_SHARE: f64 = 1e-6;

/// Edge of the voxels, metre: about [`MOST_VOXELS`] of them, fewer for a small cloud.
pub(crate) fn voxel_size(points: &[Point3<f64>]) -> Result<f64> {
    let sample: Vec<Point3<f64>> = points.iter().copied().step_by(points.len().div_ceil(SAMPLE).max(1)).collect();
    let (radius, extent) = radius_and_extent(&sample, points);
    if extent <= 0.0 {
        // All points in one place: any size will do.
        return Ok(1.0);
    }
    let smallest = SMALLEST_SHARE * extent;
    let mut probe = (radius / PROBES).max(smallest);
    let mut occupied = count(&sample, probe)?;
    while occupied * POINTS_A_PROBE > sample.len() && probe < extent {
        probe *= 2.0;
        occupied = count(&sample, probe)?;
    }
    // Surfaces: the number of cells grows with the square of their fineness.
    let wanted = (points.len() as f64 / POINTS_A_VOXEL).clamp(1.0, MOST_VOXELS);
    Ok((probe * (occupied as f64 / wanted).sqrt()).max(smallest))
}

/// Median distance from the median position, and the largest extent along an axis.
fn radius_and_extent(sample: &[Point3<f64>], points: &[Point3<f64>]) -> (f64, f64) {
    let middle = [0, 1, 2].map(|k| quantile(&mut sample.iter().map(|p| p[k]).collect::<Vec<_>>(), 0.5));
    let middle = Point3::from(middle);
    let radius = quantile(&mut sample.iter().map(|p| (p - middle).norm()).collect::<Vec<_>>(), 0.5);
    let extent = (0..3).map(|k| {
        let ends = points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p[k]), h.max(p[k])));
        ends.1 - ends.0
    });
    (radius, extent.fold(0.0, f64::max))
}

#[derive(Debug, Default, Clone)]
struct Occupied;

impl Sum for Occupied {
    type Source<'a> = ();
    fn add(&mut self, _: usize, _: [f64; 3], (): &()) {}
    fn merge(&mut self, _: &Self) {}
}

fn count(sample: &[Point3<f64>], size_m: f64) -> Result<usize> {
    let lattice = Lattice::new(sample, size_m)?;
    Ok(gather::<Occupied>(sample, &lattice, |_| true, &()).0.len())
}
