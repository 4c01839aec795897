//! A self-calibration network of a range camera: stations, targets and one shared block of 17 parameters. Image
//! coordinates in mm, ranges and coordinates in metre. Made from a seed.

use adjust::{
    Adjustment, BlockId, Covariance, DatumDefect, EvaluationFailure, Jacobians, Observation, ParameterBlock, RigidPose,
};
use nalgebra::{Isometry3, Matrix3, Point3, SMatrix, SVector, Translation3, UnitQuaternion, Vector3};
use rand::{Rng, RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

/// xp yp c, k1 k2 k3 p1 p2, d0 d2..d7, e1 e2.
pub const PARAMETERS: usize = 17;
pub const NAMES: [&str; PARAMETERS] =
    ["xp", "yp", "c", "k1", "k2", "k3", "p1", "p2", "d0", "d2", "d3", "d4", "d5", "d6", "d7", "e1", "e2"];
pub const TRUTH: [f64; PARAMETERS] =
    [0.05, -0.03, 8.0, -4e-3, 8e-5, -1e-6, 1e-4, -2e-4, 0.02, 0.01, -0.005, 0.004, 0.003, -0.002, 0.001, 0.002, -0.001];
/// Standard deviations of image coordinates (mm) and ranges (m).
pub const SIGMAS: [f64; 3] = [0.002, 0.002, 0.005];
/// Half the sensor, mm.
const HALF: [f64; 2] = [3.52, 2.88];
/// Longest wave of the periodic errors, metre.
const WAVE: f64 = 7.5;
/// Pose, target, parameters.
pub const WIDTH: usize = 6 + 3 + PARAMETERS;

/// One sighting: image coordinates and range; without a range the third component is left out.
pub struct Sighting {
    pub blocks: [BlockId; 3],
    pub observed: [f64; 3],
    /// Where the corrections are taken: the observed values without their errors. At the observed values themselves,
    /// errors of the ranges would enter the design rows and bias d0 by three standard deviations in this network.
    pub at: [f64; 3],
    pub dimension: usize,
}

/// Corrections of the observed values: design rows of the parameters.
fn corrections(observed: &[f64; 3]) -> SMatrix<f64, 3, PARAMETERS> {
    let [x, y, rho] = *observed;
    let r2 = x * x + y * y;
    let mut a = SMatrix::<f64, 3, PARAMETERS>::zeros();
    for (row, (own, other)) in [(x, y), (y, x)].into_iter().enumerate() {
        a[(row, row)] = 1.0;
        (0..3).for_each(|k| a[(row, 3 + k)] = own * r2.powi(k as i32 + 1));
        a[(row, 6 + row)] = r2 + 2.0 * own * own;
        a[(row, 7 - row)] = 2.0 * own * other;
    }
    a[(2, 8)] = 1.0;
    for k in 0..3 {
        let phase = std::f64::consts::TAU * rho / WAVE * f64::from(1 << k);
        a[(2, 9 + 2 * k)] = phase.sin();
        a[(2, 10 + 2 * k)] = phase.cos();
    }
    (a[(2, 15)], a[(2, 16)]) = (x, y);
    a
}

impl Sighting {
    /// Residuals, and the Jacobian of the model with respect to pose, target and parameters.
    pub fn linearise(
        &self,
        pose: &Isometry3<f64>,
        target: &Vector3<f64>,
        parameters: &[f64],
    ) -> (Vector3<f64>, SMatrix<f64, 3, WIDTH>) {
        let p = pose.inverse_transform_point(&Point3::from(*target)).coords;
        let design = corrections(&self.at);
        let parameters = SVector::<f64, PARAMETERS>::from_column_slice(parameters);
        let c = parameters[2];
        let range = p.norm();
        let ideal = Vector3::new(-c * p.x / p.z, -c * p.y / p.z, range);
        let residual = Vector3::from(self.observed) - ideal - design * parameters;
        let local = Matrix3::new(
            -c / p.z,
            0.0,
            c * p.x / (p.z * p.z), //
            0.0,
            -c / p.z,
            c * p.y / (p.z * p.z), //
            p.x / range,
            p.y / range,
            p.z / range,
        );
        let turned = pose.rotation.to_rotation_matrix().into_inner().transpose();
        let mut a = SMatrix::<f64, 3, WIDTH>::zeros();
        a.fixed_view_mut::<3, 3>(0, 0).copy_from(&(-local * turned));
        a.fixed_view_mut::<3, 3>(0, 3).copy_from(&(local * p.cross_matrix()));
        a.fixed_view_mut::<3, 3>(0, 6).copy_from(&(local * turned));
        a.fixed_view_mut::<3, PARAMETERS>(0, 9).copy_from(&design);
        // The principal distance acts through the ideal coordinates alone.
        (a[(0, 11)], a[(1, 11)]) = (-p.x / p.z, -p.y / p.z);
        (residual, a)
    }
}

impl Observation for Sighting {
    fn dimension(&self) -> usize {
        self.dimension
    }

    fn blocks(&self) -> &[BlockId] {
        &self.blocks
    }

    fn evaluate(
        &self,
        parameters: &[&[f64]],
        residual: &mut [f64],
        jacobians: Option<&mut Jacobians<'_>>,
    ) -> Result<(), EvaluationFailure> {
        let pose = RigidPose::isometry(parameters[0])?;
        let target = Vector3::from_column_slice(parameters[1]);
        if pose.inverse_transform_point(&Point3::from(target)).z >= 0.0 {
            return Err(EvaluationFailure::new("the target lies behind the camera"));
        }
        let (v, a) = self.linearise(&pose, &target, parameters[2]);
        residual.copy_from_slice(&v.as_slice()[..self.dimension]);
        if let Some(jacobians) = jacobians {
            for row in 0..self.dimension {
                for (block, (start, end)) in [(0, 6), (6, 9), (9, WIDTH)].into_iter().enumerate() {
                    let out = jacobians.row(block, row).iter_mut().zip(start..end);
                    out.for_each(|(out, column)| *out = a[(row, column)]);
                }
            }
        }
        Ok(())
    }
}

/// What a network is made of.
#[derive(Clone, Copy)]
pub struct RangeCameraPlan {
    /// Of stations and targets.
    pub seed: u64,
    /// Of errors and disturbances.
    pub noise: u64,
    pub stations: usize,
    pub targets: usize,
    pub sightings: usize,
    /// Every so many sightings one is without a range; 0 for none.
    pub without_range: usize,
    /// Size of the disturbance of the start values, metre and radian.
    pub disturbance: f64,
}

/// 24 stations, 103 targets: 3,078 observed values, 470 unknowns.
pub const LABORATORY: RangeCameraPlan = RangeCameraPlan {
    seed: 11,
    noise: 0,
    stations: 24,
    targets: 103,
    sightings: 1026,
    without_range: 0,
    disturbance: 0.01,
};
/// 245 stations, 2000 targets: 234,534 observed values, 7,487 unknowns.
pub const HALL: RangeCameraPlan = RangeCameraPlan {
    seed: 12,
    noise: 0,
    stations: 245,
    targets: 2000,
    sightings: 78_178,
    without_range: 0,
    disturbance: 0.01,
};

/// The model and its truth.
pub struct RangeCameraNetwork {
    pub adjustment: Adjustment<'static>,
    pub stations: Vec<BlockId>,
    pub targets: Vec<BlockId>,
    pub parameters: BlockId,
    /// Station, target, observed values and dimension of each observation.
    pub sightings: Vec<(usize, usize, Sighting)>,
    pub true_stations: Vec<Isometry3<f64>>,
    pub true_targets: Vec<Vector3<f64>>,
}

fn normal(rng: &mut impl Rng) -> f64 {
    rng.sample(StandardNormal)
}

fn random_vector(rng: &mut impl Rng) -> Vector3<f64> {
    Vector3::new(normal(rng), normal(rng), normal(rng))
}

/// Convergent and, every third, frontal stations at 1 to 5 m from the wall of targets, rolled by turns.
fn station(index: usize, rng: &mut impl Rng) -> Isometry3<f64> {
    let distance = 1.0 + 4.0 * ((index as f64 * 0.618_034).fract());
    let aim = Vector3::new(rng.random_range(-0.9..0.9), rng.random_range(-0.6..0.6), 0.0);
    let side = if index.is_multiple_of(3) { 0.0 } else { 0.7 * (index as f64 * 2.4).sin() };
    let lift = if index.is_multiple_of(3) { 0.0 } else { 0.5 * (index as f64 * 1.7).cos() };
    // The camera looks along −z: the z axis points from the aim to the camera.
    let back = Vector3::new(side, lift, 1.0).normalize();
    let looking = UnitQuaternion::face_towards(&back, &Vector3::y());
    let roll = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.5 * std::f64::consts::PI * (index % 4) as f64);
    Isometry3::from_parts(Translation3::from(aim + back * distance), looking * roll)
}

/// The observation of a target without errors, by fixed-point iteration (corrections are functions of what is observed);
/// `None` outside the sensor.
fn observe(pose: &Isometry3<f64>, target: &Vector3<f64>) -> Option<[f64; 3]> {
    let p = pose.inverse_transform_point(&Point3::from(*target)).coords;
    if p.z > -0.3 {
        return None;
    }
    let c = TRUTH[2];
    let mut ideal_parameters = SVector::<f64, PARAMETERS>::from_column_slice(&TRUTH);
    ideal_parameters[2] = 0.0;
    let ideal = Vector3::new(-c * p.x / p.z, -c * p.y / p.z, p.norm());
    let mut observed = ideal;
    for _ in 0..50 {
        observed = ideal + corrections(&observed.into()) * ideal_parameters;
    }
    (observed.x.abs() < HALF[0] && observed.y.abs() < HALF[1]).then(|| observed.into())
}

pub fn range_camera_network(plan: &RangeCameraPlan) -> RangeCameraNetwork {
    let mut rng = Pcg64::seed_from_u64(plan.seed);
    let true_targets: Vec<_> = (0..plan.targets)
        .map(|_| Vector3::new(rng.random_range(-1.6..1.6), rng.random_range(-1.1..1.1), rng.random_range(-0.4..0.4)))
        .collect();
    let true_stations: Vec<_> = (0..plan.stations).map(|i| station(i, &mut rng)).collect();
    let mut rng = Pcg64::seed_from_u64(plan.seed + 1000 * plan.noise + 1);
    let mut adjustment = Adjustment::new();
    let size = plan.disturbance;
    let parameters = adjustment.add_block(
        ParameterBlock::euclidean(std::array::from_fn::<f64, PARAMETERS, _>(|i| if i == 2 { 8.02 } else { 0.0 }))
            .with_parameter_names(NAMES),
    );
    let mut disturb = || random_vector(&mut rng) * size;
    let stations: Vec<_> = true_stations
        .iter()
        .enumerate()
        .map(|(i, pose)| {
            let turn = UnitQuaternion::from_scaled_axis(disturb());
            let moved = Translation3::from(pose.translation.vector + disturb());
            let start = Isometry3::from_parts(moved, pose.rotation * turn);
            adjustment.add_block(ParameterBlock::pose(&start).named(format!("station {i}")))
        })
        .collect();
    let targets: Vec<_> = true_targets
        .iter()
        .enumerate()
        .map(|(i, point)| {
            let start: [f64; 3] = (point + disturb()).into();
            adjustment.add_block(ParameterBlock::euclidean(start).named(format!("target {i}")))
        })
        .collect();
    let group = adjustment.add_group("sightings");
    let mut sightings = Vec::new();
    for (s, t) in visible(plan, &true_stations, &true_targets) {
        let at = observe(&true_stations[s], &true_targets[t]).unwrap();
        let observed: [f64; 3] = std::array::from_fn(|i| at[i] + SIGMAS[i] * normal(&mut rng));
        let blocks = [stations[s], targets[t], parameters];
        let lacking = plan.without_range > 0 && sightings.len() % plan.without_range == 0;
        let dimension = if lacking { 2 } else { 3 };
        let sighting = || Sighting { blocks, observed, at, dimension };
        adjustment.add_observation(group, sighting(), &Covariance::from_sigmas(&SIGMAS[..dimension])).unwrap();
        sightings.push((s, t, sighting()));
    }
    RangeCameraNetwork { adjustment, stations, targets, parameters, sightings, true_stations, true_targets }
}

/// As many sightings as wanted: stations that see many targets give some up.
fn visible(plan: &RangeCameraPlan, stations: &[Isometry3<f64>], targets: &[Vector3<f64>]) -> Vec<(usize, usize)> {
    let mut seen: Vec<Vec<(usize, usize)>> = stations
        .iter()
        .enumerate()
        .map(|(s, pose)| {
            let all = (0..targets.len()).map(|i| (i * 31 + s * 17) % targets.len());
            all.filter(|&t| observe(pose, &targets[t]).is_some()).map(|t| (s, t)).collect()
        })
        .collect();
    let count = |limit: usize| seen.iter().map(|list| list.len().min(limit)).sum::<usize>();
    let limit = (1..targets.len()).find(|&limit| count(limit) >= plan.sightings).unwrap_or(targets.len());
    let mut surplus = count(limit).saturating_sub(plan.sightings);
    for list in &mut seen {
        list.truncate(limit);
        if surplus > 0 && list.len() == limit {
            list.truncate(limit - 1);
            surplus -= 1;
        }
    }
    seen.concat()
}

impl RangeCameraNetwork {
    /// Six inner constraints on all targets.
    pub fn free(mut self) -> Self {
        self.adjustment.add_inner_constraints(&self.targets, DatumDefect::Six).unwrap();
        self
    }
}
