//! How well two clouds agree at a pose: partners on the surface, and points where the other camera looked through.

use nalgebra::Isometry3;

use crate::description::feature_cloud::FeatureCloud;
use crate::description::fpfh::{dot, subtract};
use crate::description::view::{Jumps, Sight};
use crate::verification::shared_error::Misses;
use rigid_pose::SinglePose;

/// Least cosine between the normals of partners: with 0.7, as elsewhere, one more of 126 real pairs is answered wrongly.
const LEAST_COSINE: f32 = 0.8;
/// Largest distance of partners across the surface and in all, voxels.
const ACROSS_VOXELS: f32 = 0.8;
const IN_ALL_VOXELS: f32 = 2.0;
/// A point in space that the other camera looked through counts this many times, against one with a partner where poses are
/// rough, and against one that misses the surface it should lie on: noise moves the latter over a jump, not the former.
const TIMES_IN_FREE: f64 = 2.0;
/// Points that contradict outweigh this many points with a partner each once a pose is refined: where two poses differ, both
/// find partners on walls that are alike, but only the wrong one has more than a few in a hundred that contradict.
const WEIGHT_OF_CONTRADICTION: f64 = 8.0;

/// The verdict on a pose: counts over the sampled points of both clouds.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Verdict {
    pub(crate) points: usize,
    /// With a partner.
    pub(crate) hits: usize,
    /// In front of what the other camera saw.
    pub(crate) in_free: usize,
    /// Where the other camera saw a surface, but without a partner on it.
    pub(crate) missed: usize,
    /// Share of the points with a partner, of the cloud that overlaps more.
    pub(crate) overlap: f64,
}

impl Verdict {
    /// `pose`: target from source, both about their middles. Every `stride`-th sampled point is looked at.
    pub(crate) fn new(source: &FeatureCloud, target: &FeatureCloud, pose: &Isometry3<f64>, stride: usize) -> Self {
        Self::with(source, target, pose, stride, Jumps::Unknown)
    }

    /// [`Self::new`] with what a jump of the range says about points between its two sides.
    pub(crate) fn with(
        source: &FeatureCloud,
        target: &FeatureCloud,
        pose: &Isometry3<f64>,
        stride: usize,
        jumps: Jumps,
    ) -> Self {
        let back = pose.inverse();
        let own = count(source, target, pose, stride, jumps, |_, _| true);
        own.and(&count(target, source, &back, stride, jumps, |_, _| true))
    }

    fn and(&self, other: &Self) -> Self {
        Self {
            points: self.points + other.points,
            hits: self.hits + other.hits,
            in_free: self.in_free + other.in_free,
            missed: self.missed + other.missed,
            overlap: self.overlap.max(other.overlap),
        }
    }

    /// What edges say against a pose that slides, in points: those that miss or lie in free space, at jumps of the range
    /// too, less the partners on surfaces that face the motion. All other partners grow in number with what is shared.
    /// `faces` takes a point and its normal in the target's frame.
    pub(crate) fn against_slide(
        source: &FeatureCloud,
        target: &FeatureCloud,
        pose: &Isometry3<f64>,
        faces: impl Fn([f32; 3], [f32; 3]) -> bool,
    ) -> f64 {
        let (forward, back) = (SinglePose::new(pose), pose.inverse());
        let own = count(source, target, pose, 1, Jumps::Missed, |p, n| faces(forward.moved(p), forward.turned(n)));
        let both = own.and(&count(target, source, &back, 1, Jumps::Missed, &faces));
        both.contradicting() - both.hits as f64
    }

    /// Share of the points with a partner less those in free space, doubly counted, times the square of the agreement:
    /// at most 1, possibly negative: for poses that are a few voxels off. A wrong pose that slides walls along themselves
    /// has many partners, but misses more.
    pub(crate) fn rough_score(&self) -> f64 {
        let share = (self.hits as f64 - TIMES_IN_FREE * self.in_free as f64) / (self.points as f64).max(1.0);
        share * self.agreement().powi(2)
    }

    /// What speaks for a refined pose, in points: those with a partner less those that contradict.
    pub fn evidence(&self) -> f64 {
        self.hits as f64 - WEIGHT_OF_CONTRADICTION * self.contradicting()
    }

    /// Points that contradict.
    fn contradicting(&self) -> f64 {
        self.missed as f64 + TIMES_IN_FREE * self.in_free as f64
    }

    /// Probability that as much contradicts at a right pose.
    pub(crate) fn consistency(&self, misses: &Misses) -> f64 {
        misses.probability(self.contradicting(), self.in_view())
    }

    /// Points of both clouds that the other camera should have seen.
    pub(crate) fn in_view(&self) -> f64 {
        (self.hits + self.in_free + self.missed) as f64
    }

    /// Share of hits among the points that the other camera should have seen.
    pub fn agreement(&self) -> f64 {
        self.hits as f64 / self.in_view().max(1.0)
    }
}

/// `counts` tells of a point and its normal whether a partner of it is counted.
fn count(
    from: &FeatureCloud,
    to: &FeatureCloud,
    pose: &Isometry3<f64>,
    stride: usize,
    jumps: Jumps,
    counts: impl Fn([f32; 3], [f32; 3]) -> bool,
) -> Verdict {
    let motion = SinglePose::new(pose);
    let sided = from.normals.sided && to.normals.sided;
    let voxel = to.reduced.voxel_m as f32;
    let mut count = Verdict::default();
    for &i in from.sample.iter().step_by(stride) {
        count.points += 1;
        let (own, own_normal) = (from.reduced.points[i as usize], from.normals.vectors[i as usize]);
        let (point, normal) = (motion.moved(own), motion.turned(own_normal));
        if partner(to, point, normal, sided, voxel).is_some() {
            count.hits += usize::from(counts(own, own_normal));
            continue;
        }
        let Some(view) = &to.view else { continue };
        match view.sight(point, jumps) {
            Sight::InFree => count.in_free += 1,
            Sight::OnSurface => {
                let fronts = sided && jumps == Jumps::MissedByFronts;
                count.missed += usize::from(!(fronts && view.is_behind(point, normal)));
            }
            Sight::Unknown => {}
        }
    }
    count.overlap = count.hits as f64 / count.points.max(1) as f64;
    count
}

/// The point of the surface that a point lies on.
pub(crate) fn partner(to: &FeatureCloud, point: [f32; 3], normal: [f32; 3], sided: bool, voxel: f32) -> Option<usize> {
    let near = to.labels[0].near(point)?;
    lies_on(to, near, point, normal, sided, voxel)?.then_some(near)
}

/// Whether a point lies on the surface about another one; `None` where that is too far to tell.
fn lies_on(to: &FeatureCloud, near: usize, point: [f32; 3], normal: [f32; 3], sided: bool, voxel: f32) -> Option<bool> {
    let (own, d) = (to.normals.vectors[near], subtract(point, to.reduced.points[near]));
    let cosine = if sided { dot(normal, own) } else { dot(normal, own).abs() };
    let in_all = IN_ALL_VOXELS * voxel;
    (dot(d, d) <= in_all * in_all).then(|| cosine >= LEAST_COSINE && dot(d, own).abs() <= ACROSS_VOXELS * voxel)
}

/// Share of the points of two clouds that do not lie on the surface about the next one of their own cloud: as many miss that
/// of the other at a right pose, at most, for what is uneven is uneven in both.
pub(crate) fn unevenness(clouds: [&FeatureCloud; 2]) -> f64 {
    let (mut near, mut beside) = (1_usize, 1_usize);
    for cloud in clouds {
        for i in cloud.sample.iter().map(|i| *i as usize) {
            let (point, normal) = (cloud.reduced.points[i], cloud.normals.vectors[i]);
            // Every second point labels cells: the others find another one.
            let Some(other) = cloud.labels[1].near(point).filter(|other| *other != i) else { continue };
            let on = lies_on(cloud, other, point, normal, cloud.normals.sided, cloud.reduced.voxel_m as f32);
            near += usize::from(on.is_some());
            beside += usize::from(on == Some(false));
        }
    }
    beside as f64 / (near + 1) as f64
}
