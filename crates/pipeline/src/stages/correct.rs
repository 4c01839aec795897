use std::sync::Arc;

use error_models::InterpolatedModel;

use super::Findings;
use crate::correction_record::CorrectionRecord;
use crate::progress::Progress;
use crate::view::{View, ViewData};
use crate::work::Work;
use crate::{Error, Result};

/// Range terms, amplitude-related error and fixed pattern are taken off, frequency by frequency.
pub(super) fn run(work: &mut Work, progress: &dyn Progress) -> Result<Findings> {
    let Some(calibration) = &work.calibration else {
        return Err(Error::Camera("stage CorrectRange needs a calibration; name one with --calibration".to_owned()));
    };
    let camera = work.calibrated_camera.unwrap_or(work.outcome.camera);
    let models = calibration.model_set().map_err(Error::stage("CorrectRange", "calibration"))?;
    let mut outside = 0_usize;
    let (format, principal_point_mm) = (camera.format, camera.interior.principal_point_mm);
    let pattern = calibration.fixed_pattern.clone().map(Arc::new);
    for (index, view) in work.outcome.views.iter_mut().enumerate() {
        let name = view.name();
        let models = match (view.integration_time_s, models.entries.as_slice()) {
            (Some(time), _) => models.at(time).map_err(Error::stage("CorrectRange", &name))?,
            (None, [(_, models)]) => models.iter().cloned().map(InterpolatedModel::from).collect(),
            (None, _) => {
                let message = "the survey states no integration time, which the calibration's models are chosen by";
                return Err(Error::stage("CorrectRange", &name)(message));
            }
        };
        let mut record = CorrectionRecord::new(format, principal_point_mm, pattern.clone());
        for (frame, model) in frames_with_models(view, &models)? {
            let (observed, sigma) = (frame.range.clone(), frame.sigma.clone());
            let summary = model.correct_frame(frame, &format, principal_point_mm, pattern.as_deref());
            outside += summary.map_err(Error::stage("CorrectRange", &name))?.outside_span;
            record.add(model, observed, sigma, frame);
        }
        view.correction = Some(record);
        view.combine_channels()?;
        progress.advance(index + 1);
    }
    Ok(Findings::from([("pixels_outside_span".to_owned(), outside as f64)]))
}

/// Each frequency's ranges with that frequency's model; the one frame where frequencies are not apart.
fn frames_with_models<'a>(
    view: &'a mut View,
    models: &'a [InterpolatedModel],
) -> Result<Vec<(&'a mut range_image::RangeFrame, &'a InterpolatedModel)>> {
    let name = view.name();
    if !view.channels.is_empty() {
        if view.channels.len() != models.len() {
            let message =
                format!("{} frequencies, but the calibration has models for {}", view.channels.len(), models.len());
            return Err(Error::stage("CorrectRange", &name)(message));
        }
        return Ok(view.channels.iter_mut().zip(models).collect());
    }
    match (&mut view.data, models) {
        (ViewData::Range(frame), [model]) => Ok(vec![(frame, model)]),
        (ViewData::Range(_), models) => {
            let message = format!("one range, but the calibration has models for {} frequencies", models.len());
            Err(Error::stage("CorrectRange", &name)(message))
        }
        _ => Err(Error::Needs { stage: "CorrectRange", needs: "Unwrap" }),
    }
}
