//! Correspondences with points and normals of both sides, and which two of them can hold at once.
// Only what is inlined is compiled for wide registers.
// Lazy operators would branch lane by lane.
#![allow(clippy::inline_always, clippy::needless_bitwise_bool)]

use nalgebra::{Isometry3, Point3};

use crate::description::feature_cloud::Place;
use crate::description::fpfh::{dot, subtract};
use point_cloud::SAME_SURFACE_COSINE;
use rigid_pose::{SinglePose, absolute_orientation};

/// Largest difference of the cosines between normals, and of normals with the line between the points, at which two
/// correspondences agree.
const COSINE_TOLERANCE: f32 = 0.25;

/// Correspondences: a place of the source belongs to one of the target, perhaps.
#[derive(Debug, Clone)]
pub(crate) struct Correspondences {
    pub(crate) rows: Vec<[Place; 2]>,
    /// The first so many are of the surface, the others were found by other means.
    pub(crate) of_surface: usize,
}

impl Correspondences {
    pub(crate) fn len(&self) -> usize {
        self.rows.len()
    }

    /// Pose that carries the chosen sources onto their targets best. Normals count as points at `arm` metre off the
    /// surface: two correspondences then suffice.
    pub(crate) fn solve(&self, members: &[u32], arm: f32) -> Option<Isometry3<f64>> {
        let (mut from, mut to) = (Vec::new(), Vec::new());
        for &i in members {
            let [[p, n], [q, m]] = self.rows[i as usize];
            from.push(point(p));
            to.push(point(q));
            if !n[0].is_nan() && !m[0].is_nan() {
                from.push(point(std::array::from_fn(|k| p[k] + arm * n[k])));
                to.push(point(std::array::from_fn(|k| q[k] + arm * m[k])));
            }
        }
        absolute_orientation(&from, &to, None).ok().map(|found| found.target_from_source)
    }

    /// Share of those found by other means that agree with a pose; 0 where there are none.
    pub(crate) fn added_share(&self, pose: &Isometry3<f64>, tolerance: f32) -> f64 {
        if self.of_surface == self.len() {
            return 0.0;
        }
        let agree = self.inliers(pose, tolerance).iter().filter(|&&i| i as usize >= self.of_surface).count();
        agree as f64 / (self.len() - self.of_surface) as f64
    }

    /// Correspondences that agree with a pose in position, to `tolerance` metre, and normal.
    pub(crate) fn inliers(&self, pose: &Isometry3<f64>, tolerance: f32) -> Vec<u32> {
        let motion = SinglePose::new(pose);
        let limit = tolerance * tolerance;
        (0..self.len())
            .filter(|&i| {
                let [[p, n], [q, m]] = self.rows[i];
                let difference = subtract(motion.moved(p), q);
                let turned = dot(motion.turned(n), m);
                dot(difference, difference) <= limit && (turned >= SAME_SURFACE_COSINE as f32 || turned.is_nan())
            })
            .map(|i| i as u32)
            .collect()
    }
}

/// Whether one rigid motion can carry the sources of two correspondences onto their targets: distance, normals and their angles with the connecting line stay. Two that nearly coincide
/// say the same and count as no support. `tolerance`: of distances, metre.
#[inline(always)]
pub(crate) fn agree(first: &[Place; 2], second: &[Place; 2], tolerance: f32) -> bool {
    let ([[p, n], [q, u]], [[r, m], [s, v]]) = (*first, *second);
    let (d, e) = (subtract(r, p), subtract(s, q));
    let (dd, ee) = (dot(d, d).sqrt(), dot(e, e).sqrt());
    let between = (dot(n, m) - dot(u, v)).abs();
    let at_first = (dot(n, d) - dot(u, e)).abs();
    let at_second = (dot(m, d) - dot(v, e)).abs();
    // Errors of a normal turn the line by that angle, errors of the points move the projection itself.
    let slack = COSINE_TOLERANCE * dd + tolerance;
    // An unknown normal is NaN: only a proven contradiction refuses.
    let contradicts = (between > COSINE_TOLERANCE) | (at_first > slack) | (at_second > slack);
    ((dd - ee).abs() <= tolerance) & (dd > 2.0 * tolerance) & !contradicts
}

fn point(p: [f32; 3]) -> Point3<f64> {
    Point3::from(p.map(f64::from))
}
