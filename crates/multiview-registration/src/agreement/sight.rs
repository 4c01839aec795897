//! Which stations may speak for or against each other: what one sees lies within the reach of the other's view.

use global_registration::FeatureCloud;
use nalgebra::{Isometry3, Point3};

use crate::surfaces::extents::Extent;

/// Voxels beyond the farthest point of a cloud at which a point may still lie on what it saw or before it.
const BEYOND_VOXELS: f64 = 5.0;

/// How far a cloud reaches.
#[derive(Debug, Clone)]
pub(crate) struct Sight {
    points: Vec<Point3<f64>>,
    /// Distance of the farthest point from the origin of the cloud, where the camera stood, metre, and some voxels.
    reach_m: f64,
}

impl Sight {
    pub(crate) fn new(cloud: &FeatureCloud) -> Self {
        let points = cloud.points();
        let farthest = points.iter().map(|point| point.coords.norm()).fold(0.0, f64::max);
        Self { points, reach_m: farthest + BEYOND_VOXELS * cloud.voxel_m() }
    }

    pub(crate) fn extent(&self, pose: &Isometry3<f64>) -> Extent {
        Extent::placed(self.points.iter(), pose)
    }

    /// Whether this cloud may say something of things in a box, and the other of its points in their box.
    pub(crate) fn may_judge(&self, pose: &Isometry3<f64>, things: &Extent) -> bool {
        things.is_near(&pose.translation.vector, self.reach_m)
    }
}

/// The pairs of stations of which one may say something of the other; `placed` gives how far a station reaches, and its pose.
pub(crate) fn may_judge<'a>(
    count: usize,
    placed: impl Fn(usize) -> Option<(&'a Sight, Isometry3<f64>)>,
) -> Vec<(usize, usize)> {
    let nowhere = Extent::of(std::iter::empty());
    let extents: Vec<Extent> =
        (0..count).map(|station| placed(station).map_or(nowhere, |(sight, pose)| sight.extent(&pose))).collect();
    let mut pairs = Vec::new();
    for station in 0..count {
        let Some((sight, pose)) = placed(station) else { continue };
        let around = Extent::about(&pose.translation.vector, sight.reach_m);
        let near = (0..count).filter(|&other| other != station && extents[other].meets(&around, 0.0));
        let judged = near.filter(|&other| sight.may_judge(&pose, &extents[other]));
        pairs.extend(judged.map(|other| (station.min(other), station.max(other))));
    }
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}
