//! Runs of pipelines that calibrate a network before.

use std::path::{Path, PathBuf};

use commands::plan::{DriftTreatment, NetworkCalibration};
use commands::{Inputs, Progress, produce};
use error_models::ModelSet;
use pipeline::Result;
use pipeline::run::{CALIBRATION, NETWORK, RunRequest, Summary, beside, run_with};
use range_io::calibration::Calibration;
use self_calibration::{CalibrationOptions, TermSelection};

use crate::calibrate::{CalibrateMethod, CalibrateRequest, CertificateRequest, OffsetModel, TableDefaults, calibrate};
use crate::scene::{NetworkScene, START, simulate_into};

/// Runs a pipeline, also one that calibrates a network before, and writes its results into the request's output folder;
/// network and calibration stand in folders beside it.
///
/// # Errors
/// As [`pipeline::run::run_with`] and [`calibrate()`].
pub fn run(request: &RunRequest, progress: &dyn Progress) -> Result<Summary> {
    let calibrator =
        |network: &NetworkCalibration, survey: &Path| estimate_calibration(request, network, survey, progress);
    run_with(request, &calibrator, progress)
}

/// Simulates the network, calibrates it and gives the calibration's file. It starts from the nominal camera; noise,
/// scattering and fixed pattern, which targets do not show, are those of the survey's calibration.
fn estimate_calibration(
    request: &RunRequest,
    network: &NetworkCalibration,
    survey: &Path,
    progress: &dyn Progress,
) -> Result<PathBuf> {
    let scene = request.base().join(&network.network);
    let (folder, out) = (beside(&request.out, NETWORK), beside(&request.out, CALIBRATION));
    let start = nominal_start(&scene, survey)?;
    let inputs = Inputs::default().path(&scene).survey(survey);
    produce(&folder, &inputs, |destination| simulate_into(destination, &scene, None, Some(&start)))?;
    let options = CalibrationOptions { terms: TermSelection::List(network.terms.clone()), ..Default::default() };
    calibrate(
        &CalibrateRequest {
            calibration: Some(folder.join(START)),
            survey: folder,
            lens_survey: None,
            method: CalibrateMethod::Network(options.method),
            options,
            offset: OffsetModel::Constant,
            // A network of the warm camera.
            warm_up: DriftTreatment::Leave,
            defaults: TableDefaults::default(),
            certificate: CertificateRequest::default(),
            out: out.clone(),
        },
        progress,
    )?;
    Ok(out.join(Calibration::FILE_NAME))
}

fn nominal_start(scene: &Path, survey: &Path) -> Result<Calibration> {
    let camera = NetworkScene::read(scene)?.camera.nominal_camera()?;
    let known = Calibration::read(survey)?;
    let mut start = Calibration::from_models(&camera, &ModelSet::default(), known.scattering.as_ref())?;
    (start.noise, start.range_noise, start.fixed_pattern) = (known.noise, known.range_noise, known.fixed_pattern);
    (start.noise_parameters, start.warm_up) = (known.noise_parameters, known.warm_up);
    Ok(start)
}
