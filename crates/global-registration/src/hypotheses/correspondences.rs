//! Correspondences with points and normals of both sides, and which two of them can hold at once.
// Only what is inlined is compiled for wide registers.
// Lazy operators would branch lane by lane.
#![allow(clippy::inline_always, clippy::needless_bitwise_bool)]

use nalgebra::{Isometry3, Point3};

use crate::description::fpfh::{dot, subtract};
use rigid_pose::absolute_orientation;

/// Largest difference of the cosines between normals, and of normals with the line between the points, at which two
/// correspondences agree.
const COSINE_TOLERANCE: f32 = 0.25;

/// Points and unit normals in one frame; a normal of NaN is unknown.
#[derive(Debug, Clone, Default)]
pub(crate) struct Side {
    pub(crate) points: Vec<[f32; 3]>,
    pub(crate) normals: Vec<[f32; 3]>,
}

/// Correspondences: entry i of the source belongs to entry i of the target, perhaps.
#[derive(Debug, Clone, Default)]
pub(crate) struct Correspondences {
    pub(crate) source: Side,
    pub(crate) target: Side,
    /// The first so many are of the surface, the others were found by other means.
    pub(crate) of_surface: usize,
}

impl Correspondences {
    pub(crate) fn len(&self) -> usize {
        self.source.points.len()
    }

    pub(crate) fn push(&mut self, source: ([f32; 3], [f32; 3]), target: ([f32; 3], [f32; 3])) {
        self.source.points.push(source.0);
        self.source.normals.push(source.1);
        self.target.points.push(target.0);
        self.target.normals.push(target.1);
    }

    /// Pose that carries the chosen sources onto their targets best. Normals count as points at `arm` metre off the
    /// surface: two correspondences then suffice.
    pub(crate) fn solve(&self, members: &[u32], arm: f32) -> Option<Isometry3<f64>> {
        let (mut from, mut to) = (Vec::new(), Vec::new());
        for &i in members {
            let i = i as usize;
            let (p, q) = (self.source.points[i], self.target.points[i]);
            let (n, m) = (self.source.normals[i], self.target.normals[i]);
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
        let motion = Motion::new(pose);
        let limit = tolerance * tolerance;
        (0..self.len())
            .filter(|&i| {
                let difference = subtract(motion.point(self.source.points[i]), self.target.points[i]);
                let turned = dot(motion.vector(self.source.normals[i]), self.target.normals[i]);
                dot(difference, difference) <= limit && (turned >= 0.7 || turned.is_nan())
            })
            .map(|i| i as u32)
            .collect()
    }
}

/// Whether one rigid motion can carry the sources of two correspondences (source point and normal, target point and
/// normal) onto their targets: distance, normals and their angles with the connecting line stay. Two that nearly coincide
/// say the same and count as no support. `tolerance`: of distances, metre.
#[inline(always)]
pub(crate) fn agree(first: &[f32; 12], second: &[f32; 12], tolerance: f32) -> bool {
    let three = |row: &[f32; 12], k: usize| [row[k], row[k + 1], row[k + 2]];
    let d = subtract(three(second, 0), three(first, 0));
    let e = subtract(three(second, 6), three(first, 6));
    let (n, m) = (three(first, 3), three(second, 3));
    let (u, v) = (three(first, 9), three(second, 9));
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

/// A pose in single precision, for loops over many points about the origin.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Motion {
    rows: [[f32; 3]; 3],
    shift: [f32; 3],
}

impl Motion {
    pub(crate) fn new(pose: &Isometry3<f64>) -> Self {
        let matrix = pose.rotation.to_rotation_matrix();
        let rows = std::array::from_fn(|r| std::array::from_fn(|c| matrix[(r, c)] as f32));
        Self { rows, shift: std::array::from_fn(|k| pose.translation.vector[k] as f32) }
    }

    #[inline(always)]
    pub(crate) fn vector(&self, v: [f32; 3]) -> [f32; 3] {
        self.rows.map(|row| dot(row, v))
    }

    #[inline(always)]
    pub(crate) fn point(&self, p: [f32; 3]) -> [f32; 3] {
        let turned = self.vector(p);
        std::array::from_fn(|k| turned[k] + self.shift[k])
    }
}
