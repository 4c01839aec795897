//! What two clouds have in common beyond what many places share: things inside the planes that enclose a room, and enough
//! planes to fix a pose.
//!
//! Corners of rooms fit onto each other wherever they are. Behind a wall, a floor or a ceiling nothing was seen; behind a
//! front of furniture its room was. Points with many others behind their tangent plane, in both clouds, tell places apart.

use nalgebra::{Isometry3, Matrix6, Vector3, Vector6};
use rigid_pose::{Centred, SinglePose, symmetrised};

use crate::description::feature_cloud::FeatureCloud;
use crate::description::fpfh::{dot, subtract};
use crate::options::CoarseOptions;
use crate::verification::judge::{Verdict, partner, unevenness};
use crate::verification::shared_error::{Errors, Misses, Residual, errors};

/// Share of the sampled points that must lie behind a tangent plane, and how far, voxels.
const LEAST_BEHIND: f64 = 0.02;
const BEHIND_VOXELS: f32 = 3.0;
/// Pairs that planes are made from.
const PAIRS: usize = 320;
/// Points of one plane: least cosine of their normals, distance in voxels, and growth of it with their distance.
const SAME_COSINE: f32 = 0.96;
const SAME_OFFSET_VOXELS: f32 = 0.6;
const SAME_SLOPE: f32 = 0.03;
/// Planes that are looked for.
const MOST_PLANES: usize = 12;
/// Steps of a voxel to either side that are tried where planes leave a motion open, and the smallest eigenvalue a point below which a motion
/// is open: planes whose normals differ by less than 4.4 degrees tell no motion, as noise bends them by that.
const SLIDES: i32 = 6;
const OPEN: f64 = 6e-3;
/// Least part of a normal along a motion at which the surface faces it.
const FACING: f64 = 0.4;

/// What a pose's partners tell about the place.
pub(crate) struct Common {
    /// Share of the sampled points that lie inside in both clouds, of the cloud with fewer.
    pub(crate) inside: f64,
    planes: Planes,
    /// Of the residuals on planes; `None` where there are too few.
    pub(crate) errors: Option<Errors>,
    /// What misses at right poses.
    pub(crate) misses: Misses,
}

/// A pose that edges have moved along what planes leave open.
pub(crate) struct Settled {
    pub(crate) pose: Isometry3<f64>,
    pub(crate) verdict: Verdict,
    /// Covariance of the tangent `[dt, dθ]` of the pose between the clouds' frames.
    pub(crate) covariance: Matrix6<f64>,
    /// Standard deviation of the motion that is determined least, metre at the radius; infinite where it is not known.
    pub(crate) sigma_m: f64,
}

impl Common {
    /// `pose`: target from source, both about their middles.
    pub(crate) fn new(
        source: &FeatureCloud,
        target: &FeatureCloud,
        pose: &Isometry3<f64>,
        options: &CoarseOptions,
    ) -> Self {
        let forward = pairs(source, target, pose);
        let backward = pairs(target, source, &pose.inverse());
        let count = |from: &FeatureCloud, to: &FeatureCloud, pairs: &[[usize; 2]]| {
            let inside = pairs.iter().filter(|p| is_inside(from, p[0]) && is_inside(to, p[1])).count();
            inside as f64 / from.sample.len().max(1) as f64
        };
        let inside = count(source, target, &forward).min(count(target, source, &backward));
        let planes = Planes::new(source, target, pose, &forward);
        let lengths = target.voxel_m()..planes.frame.radius_m;
        let stands_for = forward.len() as f64 / planes.points.max(1.0);
        let inverse = planes.inverse();
        let errors = errors(&planes.residuals, &inverse, lengths, options.shared_error, stands_for, options.level);
        let together = errors.map_or(1.0, |errors| errors.together);
        Self { inside, planes, errors, misses: Misses::new(unevenness([source, target]), together) }
    }

    /// Where edges put the pose along a motion that planes leave open, and the mean square about that, voxels: at a wrong
    /// place fronts of furniture lie where the other camera saw the wall behind them.
    fn held_by_edges(
        &self,
        source: &FeatureCloud,
        target: &FeatureCloud,
        pose: &Isometry3<f64>,
        motion: &Vector6<f64>,
    ) -> (f64, f64) {
        let frame = &self.planes.frame;
        let faces = |point: [f32; 3], normal: [f32; 3]| {
            let [point, normal] = [point, normal].map(|v| Vector3::from(v.map(f64::from)));
            frame.derivative(&point, &normal).dot(motion).abs() > FACING
        };
        let at = |step: i32| frame.moved(pose, &(motion * (f64::from(step) * target.voxel_m())));
        let costs = (-SLIDES..=SLIDES).map(|step| (step, Verdict::against_slide(source, target, &at(step), faces)));
        let costs: Vec<(i32, f64)> = costs.collect();
        let least = costs.iter().map(|cost| cost.1).fold(f64::INFINITY, f64::min);
        let noise = self.misses.scatter(Verdict::new(source, target, pose, 1).in_view()).max(1.0);
        let (mut sum, mut moment, mut square) = (0.0, 0.0, 0.0);
        for (step, cost) in costs {
            let (weight, step) = ((-(cost - least) / noise).exp(), f64::from(step));
            (sum, moment, square) = (sum + weight, moment + weight * step, square + weight * step * step);
        }
        let mean = moment / sum;
        // It may lie anywhere within a step: a twelfth of its square.
        (mean, square / sum - mean * mean + 1.0 / 12.0)
    }

    /// The pose with its verdict and covariance. What planes leave open is put where edges hold it.
    pub(crate) fn settled(&self, source: &FeatureCloud, target: &FeatureCloud, pose: &Isometry3<f64>) -> Settled {
        let voxel_m = target.voxel_m();
        let mut pose = *pose;
        let mut of_motion = self.errors.map_or_else(Matrix6::zeros, |errors| errors.covariance);
        for motion in self.planes.open() {
            let (mean, square) = self.held_by_edges(source, target, &pose, &motion);
            pose = self.planes.frame.moved(&pose, &(motion * (mean * voxel_m)));
            of_motion += motion * motion.transpose() * (square * voxel_m * voxel_m);
        }
        let largest =
            rigid_pose::eigen6(&of_motion, "the covariance of the pose").map(|(values, _)| values[5].max(0.0));
        let sigma_m = largest.ok().filter(|_| self.errors.is_some()).map_or(f64::INFINITY, f64::sqrt);
        let frame = Centred { centre: self.planes.frame.centre + target.reduced.middle, ..self.planes.frame };
        let to_tangent = frame.tangent_from_motion(&target.between_frames(source, &pose));
        let verdict = Verdict::new(source, target, &pose, 1);
        Settled { pose, verdict, covariance: symmetrised(&(to_tangent * of_motion * to_tangent.transpose())), sigma_m }
    }
}

/// Sampled points of one cloud and their partners in the other.
fn pairs(from: &FeatureCloud, to: &FeatureCloud, pose: &Isometry3<f64>) -> Vec<[usize; 2]> {
    let motion = SinglePose::new(pose);
    let sided = from.normals.sided && to.normals.sided;
    let voxel = to.reduced.voxel_m as f32;
    let of = |&i: &u32| {
        let i = i as usize;
        let (point, normal) = (motion.moved(from.reduced.points[i]), motion.turned(from.normals.vectors[i]));
        partner(to, point, normal, sided, voxel).map(|near| [i, near])
    };
    from.sample.iter().filter_map(of).collect()
}

/// Whether the cloud goes on behind a point's tangent plane; where normals have no side, nothing encloses.
fn is_inside(cloud: &FeatureCloud, i: usize) -> bool {
    let (point, normal) = (cloud.reduced.points[i], cloud.normals.vectors[i]);
    let margin = BEHIND_VOXELS * cloud.reduced.voxel_m as f32;
    let is_behind = |q: &&u32| dot(subtract(cloud.reduced.points[**q as usize], point), normal) < -margin;
    let least = (LEAST_BEHIND * cloud.sample.len() as f64) as usize;
    !cloud.normals.sided || cloud.sample.iter().filter(is_behind).nth(least).is_some()
}

/// Normal matrix of the planes that partners form: noise of single normals imitates resistance against sliding along walls,
/// a plane's one normal does not.
struct Planes {
    frame: Centred,
    residuals: Vec<Residual>,
    points: f64,
    /// Eigenvalues of the normal matrix, ascending, and their motions.
    values: Vector6<f64>,
    motions: Matrix6<f64>,
}

impl Planes {
    fn new(source: &FeatureCloud, cloud: &FeatureCloud, pose: &Isometry3<f64>, pairs: &[[usize; 2]]) -> Self {
        let mut on: Vec<[usize; 2]> = pairs.iter().copied().step_by(pairs.len().div_ceil(PAIRS).max(1)).collect();
        let count = on.len().max(1) as f64;
        let wide = |v: [f32; 3]| Vector3::from(v.map(f64::from));
        let place = |i: usize| wide(cloud.reduced.points[i]);
        let frame = Centred::about(on.iter().map(|&[_, i]| place(i)), cloud.voxel_m());
        let motion = SinglePose::new(pose);
        let mut residuals = Vec::new();
        for _ in 0..MOST_PLANES {
            let size = |seed: usize| on.iter().filter(|&&[_, i]| is_on_plane(cloud, seed, i)).count();
            // The first of equally large planes.
            let largest =
                on.iter().step_by(3).map(|&[_, i]| (size(i), i)).fold((0, 0), |a, b| if b.0 > a.0 { b } else { a });
            if largest.0 < 3 {
                break;
            }
            let (plane, rest): (Vec<[usize; 2]>, _) = on.iter().partition(|&&[_, i]| is_on_plane(cloud, largest.1, i));
            on = rest;
            let sum: Vector3<f64> = plane.iter().map(|&[_, i]| wide(cloud.normals.vectors[i])).sum();
            let Some(normal) = sum.try_normalize(0.0) else { continue };
            residuals.extend(plane.iter().map(|&[of_source, i]| {
                Residual {
                    place: place(i),
                    derivative: frame.derivative(&place(i), &normal),
                    distance: wide(subtract(motion.moved(source.reduced.points[of_source]), cloud.reduced.points[i]))
                        .dot(&wide(cloud.normals.vectors[i])),
                }
            }));
        }
        let matrix = residuals.iter().fold(Matrix6::zeros(), |sum, r| sum + r.derivative * r.derivative.transpose());
        let found = rigid_pose::eigen6(&matrix, "planes in common");
        let (values, motions) = found.unwrap_or_else(|_| (Vector6::zeros(), Matrix6::identity()));
        Self { frame, residuals, points: count, values, motions }
    }

    fn is_open(&self, k: usize) -> bool {
        self.values[k] < OPEN * self.points
    }

    /// Motions that are left open, but for slivers.
    fn open(&self) -> impl Iterator<Item = Vector6<f64>> {
        (0..6).filter(|&k| self.is_open(k)).map(|k| self.motions.column(k).into_owned())
    }

    /// Inverse of the normal matrix along the others.
    fn inverse(&self) -> Matrix6<f64> {
        let told = (0..6).filter(|&k| !self.is_open(k)).map(|k| (self.motions.column(k), self.values[k]));
        told.fold(Matrix6::zeros(), |sum, (motion, value)| sum + motion * motion.transpose() / value)
    }
}

fn is_on_plane(cloud: &FeatureCloud, seed: usize, i: usize) -> bool {
    let d = subtract(cloud.reduced.points[i], cloud.reduced.points[seed]);
    let (own, other) = (cloud.normals.vectors[seed], cloud.normals.vectors[i]);
    let reach = SAME_OFFSET_VOXELS * cloud.reduced.voxel_m as f32 + SAME_SLOPE * dot(d, d).sqrt();
    dot(own, other) > SAME_COSINE && dot(d, own).abs() < reach
}
