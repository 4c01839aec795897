//! A few steps of point to plane between the averaged points, from poses that are a few voxels off.

use nalgebra::{Isometry3, Matrix6, Vector3};
use point_cloud::SAME_SURFACE_COSINE;
use rigid_pose::{Centred, MotionEquations, SinglePose};

use crate::description::feature_cloud::FeatureCloud;
use crate::description::fpfh::{dot, subtract};

/// Steps with partners in cells of two voxels, then of one.
const STEPS: [usize; 2] = [5, 4];
/// Scale of the residuals' weights in voxels.
const SCALES: [f64; 2] = [1.0, 0.4];
/// Share of the mean information that is added to each motion: motions that the surfaces do not determine stay.
const DAMPING: f64 = 1e-3;

/// A refined pose.
pub(crate) struct Refined {
    pub pose: Isometry3<f64>,
    /// Root mean square distance of partners across the surface, metre.
    pub(crate) rms_m: f64,
}

/// Poses are between the clouds' middles.
pub(crate) fn refine(source: &FeatureCloud, target: &FeatureCloud, pose: &Isometry3<f64>) -> Refined {
    let mut refined = Refined { pose: *pose, rms_m: f64::NAN };
    for level in [0, 1] {
        for _ in 0..STEPS[level] {
            let system = System::new(&pairs(source, target, &refined.pose, level), target.reduced.voxel_m, level);
            let Some(pose) = system.moved(&refined.pose) else { return refined };
            refined.pose = pose;
            refined.rms_m = (system.squares / system.weight).sqrt();
        }
    }
    refined
}

/// Brings a cloud onto all of those that have been placed: `world_from_middle` of each, and of the source.
pub(crate) fn refine_among(
    source: &FeatureCloud,
    placed: &[(&FeatureCloud, Isometry3<f64>)],
    pose: &Isometry3<f64>,
    steps: usize,
) -> Isometry3<f64> {
    let mut pose = *pose;
    for _ in 0..steps {
        let mut all = Vec::new();
        for (target, world_from_target) in placed {
            let own = pairs(source, target, &(world_from_target.inverse() * pose), 1);
            all.extend(own.into_iter().map(|pair| Pair {
                point: world_from_target.rotation * pair.point + world_from_target.translation.vector,
                normal: world_from_target.rotation * pair.normal,
                residual: pair.residual,
            }));
        }
        let system = System::new(&all, source.reduced.voxel_m, 1);
        let Some(moved) = system.moved(&pose) else { return pose };
        pose = moved;
    }
    pose
}

struct Pair {
    point: Vector3<f64>,
    normal: Vector3<f64>,
    residual: f64,
}

/// Pairs, summed about their mean.
struct System {
    equations: MotionEquations,
    frame: Centred,
    weight: f64,
    squares: f64,
}

impl System {
    fn new(pairs: &[Pair], voxel_m: f64, level: usize) -> Self {
        let frame = Centred::about(pairs.iter().map(|pair| pair.point), voxel_m);
        let mut system = Self { equations: MotionEquations::default(), frame, weight: 0.0, squares: 0.0 };
        let scale = SCALES[level] * voxel_m;
        for pair in pairs {
            let weight = (-(pair.residual / scale).powi(2)).exp();
            system.equations.add(&frame.derivative(&pair.point, &pair.normal), weight, pair.residual);
            system.weight += weight;
            system.squares += weight * pair.residual * pair.residual;
        }
        system
    }

    /// The pose one step on; `None` where too few pairs or numbers that are not finite tell none.
    fn moved(&self, pose: &Isometry3<f64>) -> Option<Isometry3<f64>> {
        if self.weight < 6.0 {
            return None;
        }
        let step = self.equations.step(&Matrix6::identity(), DAMPING).ok()?;
        step.iter().all(|v| v.is_finite()).then(|| self.frame.moved(pose, &step))
    }
}

fn pairs(source: &FeatureCloud, target: &FeatureCloud, pose: &Isometry3<f64>, level: usize) -> Vec<Pair> {
    let motion = SinglePose::new(pose);
    let sided = source.normals.sided && target.normals.sided;
    let labels = &target.labels[1 - level];
    let wide = |v: [f32; 3]| Vector3::from(v.map(f64::from));
    let of = |&i: &u32| {
        let point = motion.moved(source.reduced.points[i as usize]);
        let near = labels.near(point)?;
        let (own, other) = (motion.turned(source.normals.vectors[i as usize]), target.normals.vectors[near]);
        let cosine = if sided { dot(own, other) } else { dot(own, other).abs() };
        let residual = dot(subtract(point, target.reduced.points[near]), other);
        (cosine >= SAME_SURFACE_COSINE as f32).then(|| Pair {
            point: wide(point),
            normal: wide(other),
            residual: f64::from(residual),
        })
    };
    source.sample.iter().filter_map(of).collect()
}
