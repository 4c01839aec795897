//! A network of stations that observe points: directions as image coordinates, and ranges. Made from a seed.
#![allow(clippy::unwrap_used, dead_code)]

use adjust::{
    Adjustment, BlockId, Covariance, DatumDefect, EvaluationFailure, Jacobians, Observation, ObservationId,
    ParameterBlock, RigidPose,
};
use nalgebra::{Isometry3, Matrix1x3, Matrix3, Matrix3x6, Point3, SMatrix, Translation3, UnitQuaternion, Vector3};
use rand::{Rng, RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

/// Distance between two points.
pub struct Distance {
    pub blocks: [BlockId; 2],
    pub observed: f64,
}

impl Observation for Distance {
    fn dimension(&self) -> usize {
        1
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
        let between = Vector3::from_column_slice(parameters[1]) - Vector3::from_column_slice(parameters[0]);
        let distance = between.norm();
        residual[0] = self.observed - distance;
        if let Some(jacobians) = jacobians {
            let direction: Matrix1x3<f64> = between.transpose() / distance;
            jacobians.set(0, &-direction);
            jacobians.set(1, &direction);
        }
        Ok(())
    }
}

/// Image coordinates (principal distance 1) of a point, and its range where `N` is 3.
pub struct Sight<const N: usize> {
    pub blocks: [BlockId; 2],
    pub observed: [f64; N],
}

/// `[x, y, range]` of a point in the camera frame (looking along −z).
pub fn sight(point: &Vector3<f64>) -> [f64; 3] {
    [-point.x / point.z, -point.y / point.z, point.norm()]
}

impl<const N: usize> Observation for Sight<N> {
    fn dimension(&self) -> usize {
        N
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
        let world_from_camera = RigidPose::isometry(parameters[0])?;
        let point = Point3::from_slice(parameters[1]);
        let p = world_from_camera.inverse_transform_point(&point).coords;
        if p.z >= 0.0 {
            return Err(EvaluationFailure::new("the point lies behind the camera"));
        }
        let model = sight(&p);
        for (index, residual) in residual.iter_mut().enumerate() {
            *residual = self.observed[index] - model[index];
        }
        if let Some(jacobians) = jacobians {
            let rotation = world_from_camera.rotation.to_rotation_matrix().into_inner().transpose();
            let range = p.norm();
            let local = Matrix3::new(
                -1.0 / p.z,
                0.0,
                p.x / (p.z * p.z), //
                0.0,
                -1.0 / p.z,
                p.y / (p.z * p.z), //
                p.x / range,
                p.y / range,
                p.z / range,
            );
            let local: SMatrix<f64, N, 3> = local.fixed_rows::<N>(0).into_owned();
            // p = Rᵀ (X − t): dp/dt = −Rᵀ, dp/dθ = [p]×, dp/dX = Rᵀ.
            let mut pose = Matrix3x6::zeros();
            pose.fixed_columns_mut::<3>(0).copy_from(&-rotation);
            pose.fixed_columns_mut::<3>(3).copy_from(&p.cross_matrix());
            jacobians.set(0, &(local * pose));
            jacobians.set(1, &(local * rotation));
        }
        Ok(())
    }
}

/// What a network is made of.
pub struct Plan {
    pub seed: u64,
    pub stations: usize,
    pub points: usize,
    /// Points that each station sees.
    pub seen: usize,
    pub ranges: bool,
    /// Size of the disturbance of the start values, metre and radian.
    pub disturbance: f64,
}

/// The model and its truth.
pub struct Network {
    pub adjustment: Adjustment<'static>,
    pub stations: Vec<BlockId>,
    pub points: Vec<BlockId>,
    pub observations: Vec<ObservationId>,
    pub true_stations: Vec<Isometry3<f64>>,
    pub true_points: Vec<Vector3<f64>>,
}

/// Standard deviation of image coordinates and of ranges.
pub const SIGMA: [f64; 3] = [1e-3, 1e-3, 5e-3];

fn normal(rng: &mut impl Rng) -> f64 {
    rng.sample(StandardNormal)
}

fn random_vector(rng: &mut impl Rng) -> Vector3<f64> {
    Vector3::new(normal(rng), normal(rng), normal(rng))
}

/// Stations on an arc of 3 m about a box of points, each looking at the middle, rolled by turns.
fn station(index: usize, count: usize) -> Isometry3<f64> {
    let angle = -1.0 + 2.0 * index as f64 / (count.max(2) - 1) as f64;
    let height = if index.is_multiple_of(2) { 0.6 } else { -0.4 };
    let position = Point3::new(3.0 * angle.sin(), height, 3.0 * angle.cos() + 0.3 * (index % 3) as f64);
    // face_towards looks along +z; the camera looks along −z.
    let looking = UnitQuaternion::face_towards(&position.coords, &Vector3::y());
    let roll = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.5 * std::f64::consts::PI * (index % 4) as f64);
    Isometry3::from_parts(Translation3::from(position.coords), looking * roll)
}

pub fn network(plan: &Plan) -> Network {
    let mut rng = Pcg64::seed_from_u64(plan.seed);
    let true_stations: Vec<_> = (0..plan.stations).map(|i| station(i, plan.stations)).collect();
    let true_points: Vec<_> = (0..plan.points).map(|_| Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0))).collect();
    let mut adjustment = Adjustment::new();
    let mut disturb = |scale: f64| random_vector(&mut rng) * scale;
    let stations: Vec<_> = true_stations
        .iter()
        .enumerate()
        .map(|(i, pose)| {
            let turn = UnitQuaternion::from_scaled_axis(disturb(plan.disturbance));
            let moved = Translation3::from(pose.translation.vector + disturb(plan.disturbance));
            let start = Isometry3::from_parts(moved, pose.rotation * turn);
            adjustment.add_block(ParameterBlock::pose(&start).named(format!("station {i}")))
        })
        .collect();
    let points: Vec<_> = true_points
        .iter()
        .enumerate()
        .map(|(i, point)| {
            let start: [f64; 3] = (point + disturb(plan.disturbance)).into();
            adjustment.add_block(ParameterBlock::euclidean(start).named(format!("point {i}")))
        })
        .collect();
    let group = adjustment.add_group("sights");
    let mut observations = Vec::new();
    for (index, (pose, station)) in true_stations.iter().zip(&stations).enumerate() {
        for (truth, point) in true_points.iter().zip(&points).cycle().skip(index * 31).take(plan.seen) {
            let seen = sight(&pose.inverse_transform_point(&Point3::from(*truth)).coords);
            let observed: [f64; 3] = std::array::from_fn(|i| seen[i] + SIGMA[i] * normal(&mut rng));
            let blocks = [*station, *point];
            let id = if plan.ranges {
                adjustment.add_observation(group, Sight { blocks, observed }, &Covariance::from_sigmas(&SIGMA))
            } else {
                let sight = Sight { blocks, observed: [observed[0], observed[1]] };
                adjustment.add_observation(group, sight, &Covariance::from_sigmas(&SIGMA[..2]))
            };
            observations.push(id.unwrap());
        }
    }
    Network { adjustment, stations, points, observations, true_stations, true_points }
}

/// A network at its true values of which every thirty-third sight has one component that is 15 to 35 standard deviations
/// off; and those components, by number of the sight and of the component. The datum is on all points.
pub fn network_with_gross_errors(plan: &Plan, seed: u64) -> (Network, Vec<(usize, usize)>) {
    let Network { true_stations, true_points, .. } = network(plan);
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut adjustment = Adjustment::new();
    let stations: Vec<_> = true_stations.iter().map(|pose| adjustment.add_block(ParameterBlock::pose(pose))).collect();
    let points: Vec<_> =
        true_points.iter().map(|point| adjustment.add_block(ParameterBlock::euclidean(point.as_slice()))).collect();
    let group = adjustment.add_group("sights");
    let (mut observations, mut wrong) = (Vec::new(), Vec::new());
    for (index, (pose, station)) in true_stations.iter().zip(&stations).enumerate() {
        for shift in 0..plan.seen {
            let point = (index * 31 + shift) % plan.points;
            let seen = sight(&pose.inverse_transform_point(&Point3::from(true_points[point])).coords);
            let mut observed: [f64; 3] = std::array::from_fn(|i| seen[i] + SIGMA[i] * normal(&mut rng));
            let number = observations.len();
            if number % 33 == 5 {
                let component = number % 3;
                observed[component] += SIGMA[component] * (15.0 + 20.0 * rng.random::<f64>());
                wrong.push((number, component));
            }
            let sight = Sight { blocks: [*station, points[point]], observed };
            observations.push(adjustment.add_observation(group, sight, &Covariance::from_sigmas(&SIGMA)).unwrap());
        }
    }
    adjustment.add_inner_constraints(&points, DatumDefect::Six).unwrap();
    (Network { adjustment, stations, points, observations, true_stations, true_points }, wrong)
}
