//! A few steps of point to plane between the averaged points, from poses that are a few voxels off.

use nalgebra::{Isometry3, Matrix6, Vector3, Vector6};

use super::correspondences::{Motion, moved};
use super::feature_cloud::FeatureCloud;
use super::fpfh::{dot, subtract};

/// Steps with partners in cells of two voxels, then of one.
const STEPS: [usize; 2] = [5, 4];
/// Scale of the residuals' weights in voxels.
const SCALES: [f64; 2] = [1.0, 0.4];
/// Least cosine between the normals of partners.
const LEAST_COSINE: f32 = 0.7;
/// Share of the mean of the normal matrix's diagonal that is added to it: motions that the surfaces do not determine stay.
const DAMPING: f64 = 1e-3;

/// A refined pose and how well the surfaces determine it.
pub(super) struct Refined {
    pub(super) pose: Isometry3<f64>,
    /// Smallest eigenvalue of the normal matrix over the number of pairs, rotations in units of the points' radius: 1/9
    /// where the normals of a sphere's inside point everywhere, 0 on one wall.
    pub(super) determined: f64,
    /// Root mean square distance of partners across the surface, metre.
    pub(super) rms_m: f64,
}

/// Poses are between the clouds' middles.
pub(super) fn refine(source: &FeatureCloud, target: &FeatureCloud, pose: &Isometry3<f64>) -> Refined {
    let mut refined = Refined { pose: *pose, determined: 0.0, rms_m: f64::NAN };
    for level in [0, 1] {
        for _ in 0..STEPS[level] {
            let system = System::new(source, target, &refined.pose, level);
            let Some(step) = system.step() else { return refined };
            // The system stands about the mean of its pairs.
            let turn = step.fixed_rows::<3>(3).into_owned() / system.radius;
            let shift = step.fixed_rows::<3>(0) + system.centre
                - moved(&Isometry3::identity(), Vector3::zeros(), turn).rotation * system.centre;
            refined.pose = moved(&refined.pose, shift, turn);
            refined.rms_m = (system.squares / system.weight).sqrt();
            refined.determined = system.determined();
        }
    }
    refined
}

struct System {
    normal: Matrix6<f64>,
    right: Vector6<f64>,
    weight: f64,
    squares: f64,
    centre: Vector3<f64>,
    radius: f64,
}

struct Pair {
    point: Vector3<f64>,
    normal: Vector3<f64>,
    residual: f64,
}

impl System {
    fn new(source: &FeatureCloud, target: &FeatureCloud, pose: &Isometry3<f64>, level: usize) -> Self {
        let pairs = pairs(source, target, pose, level);
        let count = pairs.len().max(1) as f64;
        let centre = pairs.iter().fold(Vector3::zeros(), |sum, p| sum + p.point) / count;
        let spread: f64 = pairs.iter().map(|p| (p.point - centre).norm_squared()).sum();
        let mut system = Self {
            normal: Matrix6::zeros(),
            right: Vector6::zeros(),
            weight: 0.0,
            squares: 0.0,
            centre,
            radius: (spread / count).sqrt().max(target.reduced.voxel_m),
        };
        let scale = SCALES[1 - level] * target.reduced.voxel_m;
        for pair in &pairs {
            system.add(pair, scale);
        }
        system
    }

    fn add(&mut self, pair: &Pair, scale: f64) {
        let weight = (-(pair.residual / scale).powi(2)).exp();
        let lever = (pair.point - self.centre).cross(&pair.normal) / self.radius;
        let n = pair.normal;
        let row = Vector6::new(n.x, n.y, n.z, lever.x, lever.y, lever.z);
        self.normal.ger(weight, &row, &row, 1.0);
        self.right -= row * (weight * pair.residual);
        self.weight += weight;
        self.squares += weight * pair.residual * pair.residual;
    }

    fn step(&self) -> Option<Vector6<f64>> {
        if self.weight < 6.0 {
            return None;
        }
        let damped = self.normal + Matrix6::identity() * (DAMPING * self.normal.trace() / 6.0);
        damped.cholesky().map(|factor| factor.solve(&self.right)).filter(|s| s.iter().all(|v| v.is_finite()))
    }

    fn determined(&self) -> f64 {
        let values = crate::eigen::eigen6(&(self.normal / self.weight.max(1.0)), "refined pose").map(|e| e.0);
        values.map_or(0.0, |v| v[0].max(0.0))
    }
}

fn pairs(source: &FeatureCloud, target: &FeatureCloud, pose: &Isometry3<f64>, level: usize) -> Vec<Pair> {
    let motion = Motion::new(pose);
    let sided = source.normals.sided && target.normals.sided;
    let labels = &target.labels[1 - level];
    let wide = |v: [f32; 3]| Vector3::from(v.map(f64::from));
    let of = |&i: &u32| {
        let point = motion.point(source.reduced.points[i as usize]);
        let near = labels.near(point)?;
        let (own, other) = (motion.vector(source.normals.vectors[i as usize]), target.normals.vectors[near]);
        let cosine = if sided { dot(own, other) } else { dot(own, other).abs() };
        let residual = dot(subtract(point, target.reduced.points[near]), other);
        (cosine >= LEAST_COSINE).then(|| Pair {
            point: wide(point),
            normal: wide(other),
            residual: f64::from(residual),
        })
    };
    source.sample.iter().filter_map(of).collect()
}
