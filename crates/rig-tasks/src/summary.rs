//! Every figure of a rig, by name: `summary.json`.

use std::fmt::Write;
use std::path::PathBuf;

use calibration_tasks::{CameraFiles, ParameterMap};
use camera_model::euler_from_pose;
use commands::{Doubt, DoubtKind, Judged};
use nalgebra::{DMatrix, Isometry3, Matrix6};
use pipeline::survey::StationPose;
use rig_calibration::{MountedCamera, RigOutcome};
use serde::Serialize;

use crate::certificate::RigCertificate;
use crate::file::RigFile;

/// The method's name in files.
pub(crate) const METHOD: &str = "rig";
/// What it does.
pub(crate) const DESCRIBE: &str =
    "lens, range terms and mountings of all cameras of a rig, poses and targets in one adjustment";

/// Names of the components of a mounting's step: translation along the rig's axes, rotation about the camera's.
const COMPONENTS: [&str; 6] = ["x_m", "y_m", "z_m", "about_x_rad", "about_y_rad", "about_z_rad"];

/// What a calibration of a rig found and how good it is.
#[derive(Debug, Clone, Serialize)]
pub struct RigSummary {
    /// The rig's folder.
    pub rig: String,
    /// Always `rig`.
    pub method: &'static str,
    /// Cameras, the frame of the rig first; empty where the calibration was refused.
    pub cameras: Vec<CameraSummary>,
    /// Covariance of all mountings together.
    pub mountings: MountingSummary,
    /// Epochs.
    pub epochs: usize,
    /// Observed values used, of all cameras.
    pub observations: usize,
    /// Unknowns.
    pub unknowns: usize,
    /// Inner constraints.
    pub datum_defect: usize,
    /// Observed values and inner constraints minus unknowns.
    pub redundancy: i64,
    /// vᵀPv; `None` where the calibration was refused.
    pub vtpv: Option<f64>,
    /// Posterior standard deviation of unit weight.
    pub sigma0: Option<f64>,
    /// Whether there is a result to trust.
    pub converged: bool,
    /// What is weakly determined or left out; why the calibration was refused.
    pub diagnosis: Vec<String>,
    /// What speaks against the result.
    pub doubts: Vec<Doubt>,
    /// What a laboratory signs; `None` where the calibration was refused.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub certificate: Option<RigCertificate>,
    /// Wall-clock time of the whole run, second.
    pub seconds: f64,
    /// The output folder.
    pub out: PathBuf,
}

/// A camera of the rig.
#[derive(Debug, Clone, Serialize)]
pub struct CameraSummary {
    /// Name.
    pub name: String,
    /// Folder of its survey, relative to the rig's.
    pub folder: PathBuf,
    /// Whether it observed ranges.
    pub has_ranges: bool,
    /// Perspective centre in the frame of the rig, metre.
    pub position_m: [f64; 3],
    /// Omega, phi and kappa of the rotation from the rig to the camera, degree.
    pub angles_deg: [f64; 3],
    /// Prior-scaled standard deviations of the position, metre; `None` of the first camera.
    pub sigma_position_m: Option<[f64; 3]>,
    /// The same of the angles, degree.
    pub sigma_angles_deg: Option<[f64; 3]>,
    /// How it sat at each epoch by what it observed there alone.
    pub by_epoch: Vec<EpochResidual>,
    /// Image points and ranges, of its own, that were rejected.
    pub rejected: usize,
    /// Its observation groups: name, observed values, rms and scale.
    pub groups: Vec<(String, usize, f64, Option<f64>)>,
    /// Its parameters, estimated and held.
    pub parameters: ParameterMap,
}

/// The step from the mounting of all epochs to that of one.
#[derive(Debug, Clone, Serialize)]
pub struct EpochResidual {
    /// Epoch.
    pub epoch: String,
    /// Along the rig's axes, millimetre.
    pub shift_mm: [f64; 3],
    /// About the camera's axes, degree.
    pub turn_deg: [f64; 3],
    /// The largest of the six in its own standard deviations.
    pub largest_in_sigmas: f64,
}

/// The covariance of the mountings of all cameras but the first, prior-scaled.
#[derive(Debug, Clone, Default, Serialize)]
pub struct MountingSummary {
    /// `<camera>.x_m` and so on: steps along the rig's axes (metre) and about the camera's axes (radian).
    pub names: Vec<String>,
    /// Standard deviations in the order of the names.
    pub sigma: Vec<f64>,
    /// Correlations, rows in the order of the names.
    pub correlation: Vec<Vec<f64>>,
}

/// Standard deviations of position (metre) and angles (radian) of a pose; `None` where it is exact.
pub(crate) fn sigmas_of(pose: &Isometry3<f64>, covariance: &Matrix6<f64>) -> Option<([f64; 3], [f64; 3])> {
    let sigmas = StationPose { world_from_camera: *pose, covariance: Some(*covariance) }.sigmas();
    sigmas.filter(|(p, a)| p.iter().chain(a).all(|sigma| sigma.is_finite() && *sigma > 0.0))
}

impl RigSummary {
    pub(crate) fn new(rig: String, file: &RigFile, files: &[CameraFiles], outcome: &RigOutcome) -> Self {
        let mut summary = Self::refused(rig, String::new());
        summary.diagnosis.clone_from(&outcome.diagnosis);
        summary.doubts = outcome.doubts.iter().map(|words| Doubt::new(DoubtKind::Contradiction, words)).collect();
        for ((camera, entry), files) in outcome.cameras.iter().zip(&file.cameras).zip(files) {
            summary.cameras.push(CameraSummary::new(camera, entry.folder().to_owned(), files));
            let has_ranges = files.network().sightings.iter().any(|seen| seen.range_m.is_some());
            if !has_ranges && !files.is_of_light() {
                let words = "its survey is of a level that has ranges, but its observations.csv has none: are these the rows of \
                             another camera?";
                summary.doubts.push(Doubt::about(DoubtKind::Calibration, camera.name.as_str(), words));
            }
        }
        summary.mountings = MountingSummary::new(outcome);
        summary.epochs = outcome.epochs.len();
        if let Some(first) = outcome.cameras.first().map(|camera| &camera.calibration) {
            summary.observations = first.observations;
            summary.unknowns = first.unknowns;
            summary.datum_defect = first.datum_defect;
            summary.redundancy = first.redundancy;
            summary.vtpv = Some(first.vtpv);
            summary.sigma0 = first.sigma0;
        }
        summary.converged = true;
        summary
    }

    /// What is left to say where a calibration was refused.
    pub(crate) fn refused(rig: String, reason: String) -> Self {
        Self {
            rig,
            method: METHOD,
            cameras: Vec::new(),
            mountings: MountingSummary::default(),
            epochs: 0,
            observations: 0,
            unknowns: 0,
            datum_defect: 0,
            redundancy: 0,
            vtpv: None,
            sigma0: None,
            converged: false,
            diagnosis: vec![reason],
            doubts: Vec::new(),
            certificate: None,
            seconds: 0.0,
            out: PathBuf::new(),
        }
    }

    /// `mountings.csv`: the columns of `stations.csv` with the camera's name first, in metre and degree.
    pub(crate) fn mountings_csv(&self) -> String {
        let mut text =
            "camera,x,y,z,omega,phi,kappa,sigma_x,sigma_y,sigma_z,sigma_omega,sigma_phi,sigma_kappa\n".to_owned();
        for camera in &self.cameras {
            let values = camera.position_m.iter().chain(&camera.angles_deg);
            let values: String = values.fold(String::new(), |all, value| all + &format!(",{value}"));
            let sigmas = camera.sigma_position_m.iter().chain(&camera.sigma_angles_deg).flatten();
            let mut sigmas: String = sigmas.fold(String::new(), |all, sigma| all + &format!(",{sigma}"));
            if sigmas.is_empty() {
                sigmas = ",".repeat(6);
            }
            // Writing to a string can't fail.
            let _ = writeln!(text, "{}{values}{sigmas}", quoted(&camera.name));
        }
        text
    }
}

/// A name as a field of a table.
fn quoted(name: &str) -> String {
    if name.contains([',', '"']) { format!("\"{}\"", name.replace('"', "\"\"")) } else { name.to_owned() }
}

impl Judged for RigSummary {
    fn doubts(&self) -> &[Doubt] {
        &self.doubts
    }
}

impl CameraSummary {
    fn new(camera: &MountedCamera, folder: PathBuf, files: &CameraFiles) -> Self {
        let pose = &camera.rig_from_camera;
        let sigmas = sigmas_of(pose, &camera.covariance);
        let own = files.summary(&camera.calibration, METHOD, DESCRIBE);
        let residual = |residual: &rig_calibration::MountingResidual| EpochResidual {
            epoch: residual.epoch.clone(),
            shift_mm: [0, 1, 2].map(|axis| 1e3 * residual.step[axis]),
            turn_deg: [3, 4, 5].map(|axis| residual.step[axis].to_degrees()),
            largest_in_sigmas: residual.step.component_div(&residual.sigma).amax(),
        };
        Self {
            name: camera.name.clone(),
            folder,
            has_ranges: files.network().sightings.iter().any(|seen| seen.range_m.is_some()),
            position_m: pose.translation.vector.into(),
            angles_deg: euler_from_pose(pose).map(f64::to_degrees),
            sigma_position_m: sigmas.map(|sigmas| sigmas.0),
            sigma_angles_deg: sigmas.map(|sigmas| sigmas.1.map(f64::to_degrees)),
            by_epoch: camera.by_epoch.iter().map(residual).collect(),
            rejected: own.rejected.len(),
            groups: own
                .groups
                .into_iter()
                .map(|group| (group.name, group.observations, group.rms, group.sigma0))
                .collect(),
            parameters: own.parameters,
        }
    }
}

impl MountingSummary {
    fn new(outcome: &RigOutcome) -> Self {
        let cameras = outcome.cameras.iter().skip(1);
        let names = cameras.flat_map(|camera| COMPONENTS.map(|component| format!("{}.{component}", camera.name)));
        let q: &DMatrix<f64> = &outcome.covariance;
        let sigma: Vec<f64> = q.diagonal().iter().map(|variance| variance.max(0.0).sqrt()).collect();
        let row =
            |i: usize| (0..sigma.len()).map(|j| if i == j { 1.0 } else { q[(i, j)] / (sigma[i] * sigma[j]) }).collect();
        Self { names: names.collect(), correlation: (0..sigma.len()).map(row).collect(), sigma }
    }
}
