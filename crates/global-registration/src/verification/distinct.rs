//! What two clouds have in common beyond what many places share: things inside the planes that enclose a room, and enough
//! planes to fix a pose.
//!
//! Corners of rooms fit onto each other wherever they are. Behind a wall, a floor or a ceiling nothing was seen; behind a
//! front of furniture its room was. Points with many others behind their tangent plane, in both clouds, tell places apart.

use nalgebra::{Isometry3, Matrix6, Vector3, Vector6};

use crate::description::feature_cloud::FeatureCloud;
use crate::description::fpfh::{dot, subtract};
use crate::hypotheses::correspondences::{Motion, moved};
use crate::verification::judge::{Verdict, partner};

/// Points that are looked for behind a tangent plane, the share that must lie there, and how far, voxels.
const WITNESSES: usize = 256;
const LEAST_BEHIND: f64 = 0.02;
const BEHIND_VOXELS: f32 = 3.0;
/// Pairs that planes are made from.
const PAIRS: usize = 320;
/// Points of one plane: least cosine of their normals, distance in voxels, and growth of it with their distance.
const SAME_COSINE: f32 = 0.96;
const SAME_OFFSET_VOXELS: f32 = 0.6;
const SAME_SLOPE: f32 = 0.03;
/// Planes that are looked for, and the smallest share of the pairs on one.
const MOST_PLANES: usize = 12;
const LEAST_ON_PLANE: f64 = 0.012;
/// How far a pose is moved to see what holds it, voxels: beyond the neighbourhoods that hits and free space allow for.
const SLIDE_VOXELS: f64 = 6.0;
/// Steps of a voxel to either side that are tried where planes leave a motion open, the share of the evidence that may be
/// missing where edges put the pose, and the smallest eigenvalue a point below which a motion is open.
const SLIDES: i32 = 6;
const HARDLY: f64 = 0.25;
const OPEN: f64 = 6e-3;
/// Least part of a normal along a motion at which the surface faces it.
const FACING: f64 = 0.4;
/// Points by which noise changes what edges say.
const COST_NOISE: f64 = 5.0;

/// What a pose's partners tell about the place.
pub(crate) struct Common {
    /// Share of the sampled points that lie inside in both clouds, of the cloud with fewer.
    pub(crate) inside: f64,
    planes: Planes,
}

impl Common {
    /// `pose`: target from source, both about their middles.
    pub(crate) fn new(source: &FeatureCloud, target: &FeatureCloud, pose: &Isometry3<f64>) -> Self {
        let forward = pairs(source, target, pose);
        let backward = pairs(target, source, &pose.inverse());
        let count = |from: &FeatureCloud, to: &FeatureCloud, pairs: &[[usize; 2]]| {
            let (own, other) = (witnesses(from), witnesses(to));
            let inside = pairs.iter().filter(|p| is_inside(from, &own, p[0]) && is_inside(to, &other, p[1])).count();
            inside as f64 / from.sample.len().max(1) as f64
        };
        let inside = count(source, target, &forward).min(count(target, source, &backward));
        let on_target: Vec<usize> = forward.iter().map(|p| p[1]).chain(backward.iter().map(|p| p[0])).collect();
        Self { inside, planes: Planes::new(target, on_target) }
    }

    /// The pose moved by this many voxels along what the planes determine least.
    pub(crate) fn slid(&self, target: &FeatureCloud, pose: &Isometry3<f64>, voxels: f64) -> Isometry3<f64> {
        self.planes.slid(pose, voxels * target.voxel_m())
    }

    /// Where edges put the pose along the motion that the planes determine least, voxels: at a wrong place fronts of furniture
    /// lie where the other camera saw the wall behind them.
    fn held_by_edges(&self, source: &FeatureCloud, target: &FeatureCloud, pose: &Isometry3<f64>) -> f64 {
        let motion = self.planes.least_determined();
        let faces = |point: [f32; 3], normal: [f32; 3]| self.planes.along(&motion, point, normal) > FACING;
        let against =
            |step: i32| Verdict::against_slide(source, target, &self.slid(target, pose, f64::from(step)), faces);
        let costs: Vec<(i32, f64)> = (-SLIDES..=SLIDES).map(|step| (step, against(step))).collect();
        let least = costs.iter().map(|cost| cost.1).fold(f64::INFINITY, f64::min);
        let weights = costs.iter().map(|(step, cost)| (f64::from(*step), (-(cost - least) / COST_NOISE).exp()));
        let (sum, moment) = weights.fold((0.0, 0.0), |(sum, moment), (step, w)| (sum + w, moment + w * step));
        moment / sum
    }

    /// The pose with its verdict, and the share of the evidence that is lost where it slides. What planes leave open is put
    /// where edges hold it, unless too much speaks against that.
    pub(crate) fn settled(
        &self,
        source: &FeatureCloud,
        target: &FeatureCloud,
        pose: &Isometry3<f64>,
    ) -> (Isometry3<f64>, Verdict, f64) {
        let at = |pose: &Isometry3<f64>, voxels: f64| {
            let pose = self.slid(target, pose, voxels);
            (pose, Verdict::new(source, target, &pose, 1))
        };
        let mut best = at(pose, 0.0);
        if self.planes.are_open() {
            let middle = at(pose, self.held_by_edges(source, target, pose));
            if middle.1.evidence() > (1.0 - HARDLY) * best.1.evidence() {
                best = middle;
            }
        }
        let lost = best.1.share_lost([-SLIDE_VOXELS, SLIDE_VOXELS].map(|voxels| at(&best.0, voxels).1));
        (best.0, best.1, lost)
    }
}

/// Sampled points of one cloud and their partners in the other.
fn pairs(from: &FeatureCloud, to: &FeatureCloud, pose: &Isometry3<f64>) -> Vec<[usize; 2]> {
    let motion = Motion::new(pose);
    let sided = from.normals.sided && to.normals.sided;
    let voxel = to.reduced.voxel_m as f32;
    let of = |&i: &u32| {
        let i = i as usize;
        let (point, normal) = (motion.point(from.reduced.points[i]), motion.vector(from.normals.vectors[i]));
        partner(to, point, normal, sided, voxel).map(|near| [i, near])
    };
    from.sample.iter().filter_map(of).collect()
}

fn witnesses(cloud: &FeatureCloud) -> Vec<[f32; 3]> {
    let stride = cloud.sample.len().div_ceil(WITNESSES).max(1);
    cloud.sample.iter().step_by(stride).map(|&i| cloud.reduced.points[i as usize]).collect()
}

/// Whether the cloud goes on behind a point's tangent plane; where normals have no side, nothing encloses.
fn is_inside(cloud: &FeatureCloud, witnesses: &[[f32; 3]], i: usize) -> bool {
    let (point, normal) = (cloud.reduced.points[i], cloud.normals.vectors[i]);
    let margin = BEHIND_VOXELS * cloud.reduced.voxel_m as f32;
    let is_behind = |q: &&[f32; 3]| dot(subtract(**q, point), normal) < -margin;
    !cloud.normals.sided || witnesses.iter().filter(is_behind).count() as f64 > LEAST_BEHIND * witnesses.len() as f64
}

/// Normal matrix of the planes that partners form: noise of single normals imitates resistance against sliding along walls,
/// a plane's one normal does not.
struct Planes {
    matrix: Matrix6<f64>,
    points: f64,
    centre: Vector3<f64>,
    radius: f64,
}

impl Planes {
    fn new(cloud: &FeatureCloud, mut on: Vec<usize>) -> Self {
        on = on.iter().copied().step_by(on.len().div_ceil(PAIRS).max(1)).collect();
        let least = ((LEAST_ON_PLANE * on.len() as f64) as usize).max(3);
        let count = on.len().max(1) as f64;
        let place = |i: usize| Vector3::from(cloud.reduced.points[i].map(f64::from));
        let centre = on.iter().fold(Vector3::zeros(), |sum, &i| sum + place(i)) / count;
        let spread: f64 = on.iter().map(|&i| (place(i) - centre).norm_squared()).sum();
        let radius = (spread / count).sqrt().max(cloud.voxel_m());
        let mut planes = Self { matrix: Matrix6::zeros(), points: count, centre, radius };
        for _ in 0..MOST_PLANES {
            let size = |seed: usize| on.iter().filter(|&&i| is_on_plane(cloud, seed, i)).count();
            // The first of equally large planes.
            let largest =
                on.iter().step_by(3).map(|&i| (size(i), i)).fold((0, 0), |a, b| if b.0 > a.0 { b } else { a });
            if largest.0 < least {
                break;
            }
            let (plane, rest): (Vec<usize>, Vec<usize>) = on.iter().partition(|&&i| is_on_plane(cloud, largest.1, i));
            on = rest;
            planes.add(&plane.iter().map(|&i| (place(i), cloud.normals.vectors[i])).collect::<Vec<_>>());
        }
        planes
    }

    fn add(&mut self, plane: &[(Vector3<f64>, [f32; 3])]) {
        let sum: Vector3<f64> = plane.iter().map(|(_, normal)| Vector3::from(normal.map(f64::from))).sum();
        let Some(normal) = sum.try_normalize(0.0) else { return };
        for (point, _) in plane {
            let lever = (point - self.centre).cross(&normal) / self.radius;
            let row = Vector6::new(normal.x, normal.y, normal.z, lever.x, lever.y, lever.z);
            self.matrix.ger(1.0, &row, &row, 1.0);
        }
    }

    /// Whether a motion is left open, but for slivers.
    fn are_open(&self) -> bool {
        rigid_pose::eigen6(&self.matrix, "planes in common").is_ok_and(|(values, _)| values[0] < OPEN * self.points)
    }

    /// Translation and turn (times the radius) that the planes determine least, of length 1; zero where that is not known.
    fn least_determined(&self) -> Vector6<f64> {
        let found = rigid_pose::eigen6(&self.matrix, "planes in common");
        found.map_or_else(|_| Vector6::zeros(), |(_, motions)| motions.column(0).into_owned())
    }

    /// How far a motion of length 1 moves a point along its normal.
    fn along(&self, motion: &Vector6<f64>, point: [f32; 3], normal: [f32; 3]) -> f64 {
        let [point, normal] = [point, normal].map(|v| Vector3::from(v.map(f64::from)));
        let turned = (motion.fixed_rows::<3>(3) / self.radius).cross(&(point - self.centre));
        (motion.fixed_rows::<3>(0) + turned).dot(&normal).abs()
    }

    /// The pose moved along the least determined motion, `distance` metre at the radius.
    fn slid(&self, pose: &Isometry3<f64>, distance: f64) -> Isometry3<f64> {
        let motion = self.least_determined() * distance;
        let turn = motion.fixed_rows::<3>(3) / self.radius;
        let turned = moved(&Isometry3::identity(), Vector3::zeros(), turn).rotation * self.centre;
        moved(pose, motion.fixed_rows::<3>(0) + self.centre - turned, turn)
    }
}

fn is_on_plane(cloud: &FeatureCloud, seed: usize, i: usize) -> bool {
    let d = subtract(cloud.reduced.points[i], cloud.reduced.points[seed]);
    let (own, other) = (cloud.normals.vectors[seed], cloud.normals.vectors[i]);
    let reach = SAME_OFFSET_VOXELS * cloud.reduced.voxel_m as f32 + SAME_SLOPE * dot(d, d).sqrt();
    dot(own, other) > SAME_COSINE && dot(d, own).abs() < reach
}
