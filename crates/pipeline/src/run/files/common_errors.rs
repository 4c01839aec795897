//! What the points of a run's cloud have in common, written beside it.

use atomic_output::OutputFolder;
use common_errors::{CommonErrorsFile, Corrected, Frame, Registered, SharedBySensor};
use error_models::SharedNoise;
use nalgebra::{Matrix6, Vector6};
use range_io::calibration::{Calibration, RangeCalibration};

use crate::run::flow::Flow;
use crate::survey::records::{StationPose, ViewRecord};
use crate::{Plan, Result, Stage};
use commands::Error;

/// Writes `common_errors.ron`, and the calibration that it belongs to.
pub(crate) fn write(
    folder: &OutputFolder,
    flow: &Flow,
    plan: &Plan,
    views: &[ViewRecord],
    poses: &[StationPose],
) -> Result<()> {
    let has = |is: fn(&Stage) -> bool| plan.stages.iter().any(is);
    let corrected = Corrected {
        rays: has(|stage| matches!(stage, Stage::CorrectImagePoint(_))),
        ranges: has(|stage| matches!(stage, Stage::CorrectRange(_))),
    };
    let calibration = flow.survey.calibration.as_deref();
    let frames: Vec<Frame> = views.iter().zip(poses).map(|(view, pose)| frame(view, pose, calibration)).collect();
    // Poses that were found one from the other have no covariance; what all surfaces at once say of them is another matter.
    let adjusted = flow.joined.adjustment.is_some() && flow.joined.clouds.len() == frames.len();
    let registered = adjusted.then_some(Registered { clouds: &flow.joined.clouds });
    let all = |frames: &[Frame], registered| {
        common_errors::common_errors(frames, flow.camera(), calibration.map(|known| (known, corrected)), registered)
    };
    // The poses stand; how they follow the calibration is the only thing not known.
    let alone = |why: &str| {
        let alone =
            |(frame, pose): (&Frame, &StationPose)| Frame { stated_covariance: pose.covariance, ..frame.clone() };
        let alone: Vec<Frame> = frames.iter().zip(poses).map(alone).collect();
        let mut file = all(&alone, None).map_err(failed)?;
        file.not_in_it.push(format!("how the poses follow the calibration: {why}"));
        Ok::<_, Error>(file)
    };
    let by_frames = flow.joined.adjustment.is_some() && flow.joined.clouds.is_empty();
    let mut file: CommonErrorsFile = match registered {
        None if by_frames => alone("they come from pairs of frames")?,
        _ => match all(&frames, registered) {
            Err(common_errors::Error::Registration(_) | common_errors::Error::Calibration) => {
                alone("they do not come together again")?
            }
            found => found.map_err(failed)?,
        },
    };
    if let Some(calibration) = calibration {
        calibration.write(folder.file(Calibration::FILE_NAME)?)?;
        file.calibration = Some(Calibration::FILE_NAME.to_owned());
        if flow.survey.survey.camera.modulation_hz.len() > 1 {
            file.not_in_it.push("range terms: the ranges are those of several frequencies".to_owned());
        }
    }
    // One without is the station that the others are stated from.
    let without = frames.iter().filter(|frame| frame.stated_covariance.is_none()).count();
    if registered.is_none() && !by_frames && views.len() > 1 && without > 1 {
        file.not_in_it
            .push("poses: no stage adjusted them, and stations.csv states no standard deviations of all".to_owned());
    }
    file.write(folder.file(CommonErrorsFile::FILE_NAME)?).map_err(failed)
}

fn frame(view: &ViewRecord, pose: &StationPose, calibration: Option<&Calibration>) -> Frame {
    let [position, attitude] = view.stated_sigma;
    let stated = position.zip(attitude).filter(|_| pose.covariance.is_none() && view.stated.is_some());
    Frame {
        view: view.name.clone(),
        station: view.station.clone(),
        world_from_camera: pose.world_from_camera,
        // In space: a third of the variance along each axis.
        stated_covariance: stated.map(|(position, attitude)| {
            let [along, about] = [position, attitude].map(|sigma| sigma * sigma / 3.0);
            Matrix6::from_diagonal(&Vector6::new(along, along, along, about, about, about))
        }),
        range_model: calibration.and_then(|known| range_model(&known.range_models, view.integration_time_s)),
        drift_sigma_m: view.drift.as_ref().map(|drift| drift.sigma_m),
        sensor: calibration.and_then(|known| known.range_noise?.shared).map(shared),
    }
}

/// What the noise of neighbouring pixels has in common.
fn shared(noise: SharedNoise) -> SharedBySensor {
    SharedBySensor { sigma_m: 0.0, share: noise.share, width_px: noise.width_px }
}

/// The terms of the one frequency at the integration time that is nearest.
fn range_model(models: &[RangeCalibration], time_s: Option<f64>) -> Option<usize> {
    let one =
        models.iter().all(|model| (model.modulation_hz - models[0].modulation_hz).abs() < 1e-6 * model.modulation_hz);
    let off = |index: &usize| time_s.map_or(0.0, |time_s| (models[*index].integration_time_s / time_s).ln().abs());
    (0..models.len()).filter(|_| one).min_by(|a, b| off(a).total_cmp(&off(b)))
}

fn failed(error: common_errors::Error) -> Error {
    match error {
        common_errors::Error::Io(source) => source.into(),
        other => Error::stage("Adjust", "common errors")(other),
    }
}
