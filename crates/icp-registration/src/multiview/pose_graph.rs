//! The poses of all stations from relative poses with their covariances, through one adjustment.

use adjust::{
    Adjustment, BlockId, Covariance, EvaluationFailure, FunctionObservation, Jacobians, Kernel, ParameterBlock,
    RigidPose, Scale, SolveOptions,
};
use nalgebra::{DMatrix, Isometry3, Matrix3, Matrix6, Vector3, Vector6};

use crate::error::{Error, Result};
use crate::pose::pose_difference;

/// Relative pose of two stations, as ICP gives it.
#[derive(Debug, Clone, PartialEq)]
pub struct PairConstraint {
    /// Index of the target station.
    pub target: usize,
    /// Index of the source station.
    pub source: usize,
    /// Observed pose of the source in the target's frame.
    pub target_from_source: Isometry3<f64>,
    /// Its covariance in the tangent `[dt target axes, dtheta source axes]`, metre and radian.
    pub covariance: Matrix6<f64>,
}

/// What fixes the common frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Datum {
    /// One station keeps its pose.
    Station(usize),
    /// None is preferred: positions and attitudes are on average those at the start, which makes the covariances as
    /// small as they can be.
    InnerConstraints,
}

/// Options of [`adjust_stations`].
#[derive(Debug, Clone, PartialEq)]
pub struct StationAdjustmentOptions {
    /// Distance of a relative pose, in its own standard deviations (Mahalanobis, six components), beyond which it loses
    /// weight as in `[Huber1981]`. Default 3.55: 95 % of the right pairs are closer. `None`: least squares.
    pub huber_distance: Option<f64>,
}

impl Default for StationAdjustmentOptions {
    fn default() -> Self {
        Self { huber_distance: Some(3.55) }
    }
}

/// How one relative pose fits the adjusted stations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairResidual {
    /// Distance between observed and adjusted translation, metre.
    pub translation_m: f64,
    /// Angle between observed and adjusted rotation, radian.
    pub rotation_rad: f64,
    /// Residual in standard deviations of the observation (Mahalanobis, six components); a wrong pair stands out.
    pub mahalanobis: f64,
}

/// All stations in one frame.
#[derive(Debug, Clone)]
pub struct StationAdjustment {
    /// Adjusted poses, in the order of the initial ones.
    pub world_from_station: Vec<Isometry3<f64>>,
    /// Covariance of each pose in the tangent `[dt world axes, dtheta station axes]`, prior-scaled; zero for the datum.
    pub covariance: Vec<Matrix6<f64>>,
    /// Standard deviation of unit weight; `None` without redundancy.
    pub sigma0: Option<f64>,
    /// Six observations a pair less six unknowns a free station.
    pub redundancy: i64,
    /// One for each constraint, in their order.
    pub residuals: Vec<PairResidual>,
}

/// Adjusts the poses of all stations from relative poses.
///
/// Observation equation of a pair: `target_from_source = world_from_target⁻¹ · world_from_source`, weighted by the
/// inverse of its covariance; solved by the engine of the crate `adjust`.
///
/// # Errors
/// [`Error::LengthMismatch`], [`Error::NoSuchStation`] for an index out of range, [`Error::Adjustment`] where the pairs
/// do not connect all stations, or leave a pose undetermined.
pub fn adjust_stations(
    pairs: &[PairConstraint],
    initial_world_from_station: &[Isometry3<f64>],
    datum: Datum,
    options: &StationAdjustmentOptions,
) -> Result<StationAdjustment> {
    let count = initial_world_from_station.len();
    require_poses(count, initial_world_from_station)?;
    let fixed = datum.held_station();
    for station in pairs.iter().flat_map(|pair| [pair.target, pair.source]).chain([fixed]) {
        if station >= count {
            return Err(Error::NoSuchStation { station, count });
        }
    }
    let mut network = Adjustment::new();
    let named = |(index, pose): (usize, &Isometry3<f64>)| ParameterBlock::pose(pose).named(format!("station {index}"));
    let blocks: Vec<BlockId> =
        initial_world_from_station.iter().enumerate().map(named).map(|block| network.add_block(block)).collect();
    network.hold(blocks[fixed]).map_err(adjustment)?;
    let group = network.add_group("relative poses");
    if let Some(distance) = options.huber_distance {
        network.set_kernel(group, Kernel::Huber(distance)).map_err(adjustment)?;
    }
    for pair in pairs {
        let observed = pair.target_from_source;
        let observation = FunctionObservation::new(
            [blocks[pair.target], blocks[pair.source]],
            6,
            move |poses, residual, jacobians| relative_pose(&observed, poses, residual, jacobians),
        );
        network.add_observation(group, observation, &Covariance::from_matrix(&pair.covariance)).map_err(adjustment)?;
    }
    // Covariances of weakly determined pairs reach over eight decades: below this the steps are rounding.
    let options = SolveOptions { step_tolerance: 1e-3, ..SolveOptions::default() };
    let solution = network.solve(&options).map_err(adjustment)?;
    let poses =
        blocks.iter().map(|block| solution.pose(*block)).collect::<adjust::Result<Vec<_>>>().map_err(adjustment)?;
    let free = solution.covariance_matrix(Scale::Prior).map_err(adjustment)?;
    let cofactors = with_held_station(&free, 6 * fixed, 6 * count);
    let (poses, cofactors) = datum.apply(initial_world_from_station, poses, cofactors, lever_m(pairs));
    Ok(StationAdjustment {
        covariance: (0..count).map(|k| cofactors.fixed_view::<6, 6>(6 * k, 6 * k).into_owned()).collect(),
        sigma0: solution.sigma0(),
        redundancy: solution.redundancy(),
        residuals: pairs.iter().map(|pair| pair_residual(pair, &poses)).collect(),
        world_from_station: poses,
    })
}

/// Root mean square distance of paired stations: where rotations count as lengths.
fn lever_m(pairs: &[PairConstraint]) -> f64 {
    let squares: f64 = pairs.iter().map(|pair| pair.target_from_source.translation.vector.norm_squared()).sum();
    (squares / pairs.len().max(1) as f64).sqrt().max(f64::MIN_POSITIVE.sqrt())
}

/// Puts zeros in for the six unknowns from `first` on.
pub(super) fn with_held_station(free: &DMatrix<f64>, first: usize, size: usize) -> DMatrix<f64> {
    let place = |k: usize| match k {
        _ if k < first => Some(k),
        _ if k < first + 6 => None,
        _ => Some(k - 6),
    };
    DMatrix::from_fn(size, size, |r, c| match (place(r), place(c)) {
        (Some(r), Some(c)) => free[(r, c)],
        _ => 0.0,
    })
}

/// Residual `v = observed − model` in the tangent of the relative pose, and the Jacobian of the model.
fn relative_pose(
    observed: &Isometry3<f64>,
    poses: &[&[f64]],
    residual: &mut [f64],
    jacobians: Option<&mut Jacobians<'_>>,
) -> std::result::Result<(), EvaluationFailure> {
    let (v, by_target, by_source) = relative_pose_parts(observed, poses)?;
    residual.copy_from_slice(v.as_slice());
    let Some(jacobians) = jacobians else { return Ok(()) };
    jacobians.set(0, &by_target);
    jacobians.set(1, &by_source);
    Ok(())
}

/// The residual of a relative pose, and the Jacobians of the model by target and source.
pub(super) fn relative_pose_parts(
    observed: &Isometry3<f64>,
    poses: &[&[f64]],
) -> std::result::Result<(Vector6<f64>, Matrix6<f64>, Matrix6<f64>), EvaluationFailure> {
    let world_from_target = RigidPose::isometry(poses[0])?;
    let world_from_source = RigidPose::isometry(poses[1])?;
    let model = world_from_target.inverse() * world_from_source;
    let v = pose_difference(&model, observed);
    // Steps [dt world, dtheta own axes] move the relative pose R = Rt^T Rs, t = Rt^T (ts - tt) by
    //   source: dt = Rt^T dts,                 dtheta = dthetas
    //   target: dt = -Rt^T dtt + [t]x dthetat, dtheta = -R^T dthetat
    // and v by minus that, the rotation through the inverse left Jacobian at v: log(exp(-dtheta) exp(v)).
    let turned = inverse_left_jacobian(&v.fixed_rows::<3>(3).into_owned());
    let target_from_world = world_from_target.rotation.inverse().to_rotation_matrix().into_inner();
    let source_from_target = model.rotation.inverse().to_rotation_matrix().into_inner();
    let mut by_target = Matrix6::zeros();
    by_target.fixed_view_mut::<3, 3>(0, 0).copy_from(&-target_from_world);
    by_target.fixed_view_mut::<3, 3>(0, 3).copy_from(&model.translation.vector.cross_matrix());
    by_target.fixed_view_mut::<3, 3>(3, 3).copy_from(&-(turned * source_from_target));
    let mut by_source = Matrix6::zeros();
    by_source.fixed_view_mut::<3, 3>(0, 0).copy_from(&target_from_world);
    by_source.fixed_view_mut::<3, 3>(3, 3).copy_from(&turned);
    Ok((v, by_target, by_source))
}

/// `J⁻¹` with `log(exp(-d) exp(v)) = v - J⁻¹(v) d` to first order in d.
fn inverse_left_jacobian(v: &Vector3<f64>) -> Matrix3<f64> {
    let angle = v.norm();
    let cross = v.cross_matrix();
    // The factor tends to 1/12; below a hundredth of a radian its next term, angle² / 720, is under 1e-6 of it.
    let factor = if angle < 1e-2 {
        1.0 / 12.0 + angle * angle / 720.0
    } else {
        1.0 / (angle * angle) - (1.0 + angle.cos()) / (2.0 * angle * angle.sin())
    };
    Matrix3::identity() - 0.5 * cross + factor * cross * cross
}

fn pair_residual(pair: &PairConstraint, world_from_station: &[Isometry3<f64>]) -> PairResidual {
    let model = world_from_station[pair.target].inverse() * world_from_station[pair.source];
    let v = pose_difference(&model, &pair.target_from_source);
    // The covariance was accepted by the adjustment, so it has an inverse; without one the residual has no scale.
    let mahalanobis = pair.covariance.cholesky().map_or(f64::NAN, |factor| v.dot(&factor.solve(&v)).max(0.0).sqrt());
    PairResidual { translation_m: v.fixed_rows::<3>(0).norm(), rotation_rad: v.fixed_rows::<3>(3).norm(), mahalanobis }
}

pub(super) fn require_poses(stations: usize, poses: &[Isometry3<f64>]) -> Result<()> {
    if stations == 0 {
        return Err(Error::Empty { what: "the list of stations" });
    }
    if poses.len() != stations {
        return Err(Error::LengthMismatch { what: "poses of the stations", expected: stations, found: poses.len() });
    }
    Ok(())
}

#[allow(clippy::needless_pass_by_value)] // the form that map_err takes
pub(super) fn adjustment(error: adjust::Error) -> Error {
    Error::Adjustment(error.to_string())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use adjust::{ParameterBlock, check_jacobian};

    #[test]
    fn the_jacobian_of_a_relative_pose_agrees_with_differences() {
        let target = Isometry3::new(Vector3::new(0.4, -1.0, 0.3), Vector3::new(0.5, -1.1, 2.0));
        let source = Isometry3::new(Vector3::new(-0.7, 0.2, 1.5), Vector3::new(-0.2, 0.9, 0.4));
        // Far from the model, so that the curvature of rotations counts.
        let observed =
            target.inverse() * source * Isometry3::new(Vector3::new(0.1, 0.2, -0.3), Vector3::new(0.4, -0.3, 0.5));
        let mut network = Adjustment::new();
        let blocks = [target, source].map(|pose| network.add_block(ParameterBlock::pose(&pose)));
        let observation = FunctionObservation::new(blocks, 6, move |poses, residual, jacobians| {
            relative_pose(&observed, poses, residual, jacobians)
        });
        let worst = check_jacobian(&observation, &[ParameterBlock::pose(&target), ParameterBlock::pose(&source)]);
        // Rotations far from the model are curved: differences are good to a few 1e-6 there. Without the inverse left
        // Jacobian the two would differ by 0.3.
        let worst = worst.unwrap().worst;
        assert!(worst < 1e-5, "{worst}");
    }
}
