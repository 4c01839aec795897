//! Which stations see the same surfaces.

use nalgebra::Isometry3;
use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::icp::IcpTarget;

/// Points of a source that are looked up: enough for one percent.
const SAMPLES: usize = 1500;

/// How much of one station's cloud another one has seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overlap {
    /// Index of the station whose points are looked for.
    pub source: usize,
    /// Index of the station in whose cloud they are looked for; smaller than `source`.
    pub target: usize,
    /// Fraction of the source's points that have a point of the target within the distance.
    pub fraction: f64,
}

/// The overlap of all pairs of stations at the given poses, pairs in ascending order of target, then source.
///
/// `distance_m`: how far a partner may be away; about the error of the poses plus the spacing of the points.
///
/// # Errors
/// [`Error::LengthMismatch`] where poses and stations differ in number, [`Error::NotPositive`] for the distance.
pub fn find_overlaps(
    stations: &[IcpTarget],
    world_from_station: &[Isometry3<f64>],
    distance_m: f64,
) -> Result<Vec<Overlap>> {
    super::pose_graph::require_poses(stations.len(), world_from_station)?;
    if distance_m.is_nan() || distance_m <= 0.0 {
        return Err(Error::NotPositive { what: "distance_m", index: 0, value: distance_m });
    }
    let pairs: Vec<(usize, usize)> = (0..stations.len())
        .flat_map(|target| (target + 1..stations.len()).map(move |source| (target, source)))
        .collect();
    let overlap = |&(target, source): &(usize, usize)| {
        let target_from_source = world_from_station[target].inverse() * world_from_station[source];
        let points = &stations[source].cloud().points;
        let sampled = points.iter().step_by(points.len().div_ceil(SAMPLES).max(1));
        let (mut seen, mut asked) = (0_usize, 0_usize);
        for point in sampled {
            asked += 1;
            seen += usize::from(
                stations[target].tree().nearest_within(&(target_from_source * point), distance_m)?.is_some(),
            );
        }
        Ok(Overlap { source, target, fraction: seen as f64 / asked.max(1) as f64 })
    };
    pairs.par_iter().map(overlap).collect()
}
