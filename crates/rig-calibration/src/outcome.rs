//! What a calibration of a rig found.

use adjust::{BlockId, Scale};
use nalgebra::{DMatrix, Isometry3, Matrix6, Vector6};
use rigid_pose::{pose_difference, product_jacobians, symmetrised};
use self_calibration::{AdjustedStation, AdjustedTarget, CalibrationOptions, CalibrationOutcome, outcome};

use crate::adjustment::Adjusted;
use crate::alone::Alone;
use crate::rig::Rig;
use crate::{Error, Result};

/// A calibrated rig.
#[derive(Debug, Clone)]
pub struct RigOutcome {
    /// The cameras, in the order of the rig.
    pub cameras: Vec<MountedCamera>,
    /// Prior-scaled covariance of the tangent steps `[dt rig m, dθ camera rad]` of the mountings of the second and all
    /// further cameras, one after the other.
    pub covariance: DMatrix<f64>,
    /// Adjusted epochs: `world_from_camera` of the first camera, which is `world_from_rig`.
    pub epochs: Vec<AdjustedStation>,
    /// Adjusted targets.
    pub targets: Vec<AdjustedTarget>,
    /// What is weakly determined or left out, in sentences that name the camera.
    pub diagnosis: Vec<String>,
    /// What speaks against the result, in such sentences.
    pub doubts: Vec<String>,
}

/// A camera with its mounting and its calibration.
#[derive(Debug, Clone)]
pub struct MountedCamera {
    /// Name.
    pub name: String,
    /// How it sits: points of the camera's frame into that of the rig. Identity for the first camera.
    pub rig_from_camera: Isometry3<f64>,
    /// Prior-scaled covariance of the tangent step `[dt rig m, dθ camera rad]`; zero for the first camera.
    pub covariance: Matrix6<f64>,
    /// Lens and range terms with the camera's residuals. Figures of the adjustment (observations, unknowns, redundancy,
    /// vᵀPv, sigma0) are those of the whole rig; the stations are the poses of this camera.
    pub calibration: CalibrationOutcome,
    /// How the camera sat at each epoch by what it observed there alone.
    pub by_epoch: Vec<MountingResidual>,
}

/// How a camera sat at one epoch, by what it observed there alone: the step from the mounting of all epochs.
#[derive(Debug, Clone, PartialEq)]
pub struct MountingResidual {
    /// Name of the epoch.
    pub epoch: String,
    /// Step `[dt rig m, dθ camera rad]` from the mounting of all epochs.
    pub step: Vector6<f64>,
    /// Prior-scaled standard deviations of the step from the camera's own observations at the epoch.
    pub sigma: Vector6<f64>,
}

impl RigOutcome {
    /// Posterior standard deviation of unit weight, one for all cameras.
    pub fn sigma0(&self) -> Option<f64> {
        self.cameras.first().and_then(|camera| camera.calibration.sigma0)
    }

    /// A camera by its name.
    pub fn camera(&self, name: &str) -> Option<&MountedCamera> {
        self.cameras.iter().find(|camera| camera.name == name)
    }
}

/// Puts the outcome together and judges it.
pub(crate) fn outcome_of(
    rig: &Rig,
    alone: &[Alone],
    adjusted: &Adjusted<'_>,
    left_out: &[String],
    options: &CalibrationOptions,
) -> Result<RigOutcome> {
    let (mut cameras, mut doubts) = (Vec::new(), Vec::new());
    let mut diagnosis = adjusted.diagnosis.clone();
    diagnosis.extend_from_slice(left_out);
    for (index, (camera, alone)) in rig.cameras.iter().zip(alone).enumerate() {
        let (setup, solved) = (&adjusted.setups[index], &adjusted.solved[index]);
        let named = |words: &String| format!("camera `{}`: {words}", camera.name);
        let mut calibration = outcome(setup, solved, options)?;
        calibration.decisions.clone_from(&alone.decisions);
        let (stations, hopeless) = calibration.doubts_of_rejection(setup.network);
        if hopeless {
            return Err(Error::Hopeless { camera: camera.name.clone(), reason: stations.join("; ") });
        }
        calibration.doubts = stations;
        calibration.doubts.extend(calibration.doubts_of_tests());
        doubts.extend(calibration.doubts.iter().map(named));
        diagnosis.extend(alone.diagnosis.iter().map(named));
        let (rig_from_camera, covariance) = match solved.blocks.mounting {
            Some(block) => (solved.solution.pose(block)?, block_covariance(adjusted, [block; 2])?),
            None => (Isometry3::identity(), Matrix6::zeros()),
        };
        let by_epoch = if index > 0 { by_epoch(adjusted, index, &rig_from_camera)? } else { Vec::new() };
        cameras.push(MountedCamera { name: camera.name.clone(), rig_from_camera, covariance, calibration, by_epoch });
    }
    doubts.dedup();
    let (epochs, targets) = cameras
        .first()
        .map(|first| (first.calibration.stations.clone(), first.calibration.targets.clone()))
        .unwrap_or_default();
    Ok(RigOutcome { covariance: mounting_covariance(adjusted)?, cameras, epochs, targets, diagnosis, doubts })
}

fn block_covariance(adjusted: &Adjusted<'_>, [row, column]: [BlockId; 2]) -> Result<Matrix6<f64>> {
    let covariance = adjusted.solved[0].solution.covariance_between(row, column, Scale::Prior)?;
    Ok(Matrix6::from_fn(|row, column| covariance[(row, column)]))
}

fn mounting_covariance(adjusted: &Adjusted<'_>) -> Result<DMatrix<f64>> {
    let blocks: Vec<BlockId> = adjusted.solved.iter().filter_map(|solved| solved.blocks.mounting).collect();
    let mut out = DMatrix::zeros(6 * blocks.len(), 6 * blocks.len());
    for (row, &first) in blocks.iter().enumerate() {
        for (column, &second) in blocks.iter().enumerate() {
            out.fixed_view_mut::<6, 6>(6 * row, 6 * column).copy_from(&block_covariance(adjusted, [first, second])?);
        }
    }
    Ok(out)
}

fn by_epoch(adjusted: &Adjusted<'_>, index: usize, mounting: &Isometry3<f64>) -> Result<Vec<MountingResidual>> {
    let (setup, solved) = (&adjusted.setups[index], &adjusted.solved[index]);
    let mut out = Vec::new();
    for (station, epoch) in setup.network.stations.iter().enumerate() {
        // Targets of one line orient nothing: there is no residual then.
        let Ok(Some((world_from_camera, covariance))) = setup.station_alone(solved, station) else { continue };
        let rig_from_world = solved.solution.pose(solved.blocks.stations[station])?.inverse();
        let (_, by_camera) = product_jacobians(&rig_from_world, &world_from_camera);
        let covariance = symmetrised(&(by_camera * covariance * by_camera.transpose()));
        let step = pose_difference(mounting, &(rig_from_world * world_from_camera));
        out.push(MountingResidual {
            epoch: epoch.name.clone(),
            step,
            sigma: covariance.diagonal().map(|v| v.max(0.0).sqrt()),
        });
    }
    Ok(out)
}
