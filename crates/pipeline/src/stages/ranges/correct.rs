use std::sync::Arc;

use error_models::{InterpolatedModel, ModelSet, RangeErrorModel};
use range_image::RangeFrame;
use range_io::survey::ReferencePath;

use crate::command::progress::Progress;
use crate::plan::{CorrectRangeOptions, DriftTreatment};
use crate::stages::Findings;
use crate::stages::ranges::reference_path;
use crate::survey::compatible::model_set;
use crate::survey::correction_record::CorrectionRecord;
use crate::survey::drift::{DriftCurve, ViewDrift};
use crate::survey::view::{View, ViewData};
use crate::survey::work::Work;
use crate::{Error, Result};

/// Drift, range terms, amplitude-related error and fixed pattern are taken off, frequency by frequency.
pub(crate) fn run(work: &mut Work, options: &CorrectRangeOptions, progress: &dyn Progress) -> Result<Findings> {
    let Some(calibration) = &work.calibration else {
        return Err(Error::Camera("stage CorrectRange needs a calibration; name one with --calibration".to_owned()));
    };
    let camera = work.calibrated_camera.unwrap_or(work.outcome.camera);
    let set = model_set(&work.outcome.survey, calibration)?;
    let (format, principal_point_mm) = (camera.format, camera.interior.principal_point_mm);
    let pattern = calibration.fixed_pattern.clone().map(Arc::new);
    let sensor = reference_path::Sensor { format, principal_point_mm, pattern: pattern.as_deref() };
    let survey = &work.outcome.survey;
    let apply = options.warm_up == DriftTreatment::Apply;
    let (reference, span) = (survey.reference_path, calibration.span);
    let calibrated = calibration.warm_up.as_ref().filter(|_| apply && reference.is_none());
    let curve = calibrated.map(|calibrated| DriftCurve::new(calibrated, survey)).transpose();
    let curve = curve.map_err(Error::stage("CorrectRange", "calibration"))?;
    let drifts = calibration.warm_up.is_some() || reference.is_some();
    let (mut outside, mut found) = (0_usize, Vec::new());
    for (index, view) in work.outcome.views.iter_mut().enumerate() {
        let name = view.name();
        let mut models = models_of(&set, view, drifts)?;
        let drift = match (&reference, &curve) {
            (Some(path), _) if apply => Some(reference_drift(view, path, &models, &sensor)?),
            (_, Some(curve)) => Some(curve.of_view(view, survey).map_err(Error::stage("CorrectRange", &name))?),
            _ => None,
        };
        if let Some(drift) = &drift {
            for model in &mut models {
                model.add_offset(drift.drift_m);
            }
            found.push(drift.clone());
        }
        let mut record = CorrectionRecord::new(format, principal_point_mm, pattern.clone(), drift, span);
        for (frame, model) in frames_with_models(view, &models)? {
            let (observed, sigma) = (frame.range.clone(), frame.sigma.clone());
            let summary = model.correct_frame(frame, &format, principal_point_mm, pattern.as_deref());
            work.span.flag(&span, &observed, frame);
            outside += summary.map_err(Error::stage("CorrectRange", &name))?.outside_span;
            if let Some(path) = &reference {
                reference_path::mask(path, frame);
            }
            record.add(model, observed, sigma, frame);
        }
        view.correction = Some(record);
        view.combine_channels()?;
        progress.advance(index + 1);
    }
    Ok(findings(outside, &found))
}

/// The models of a view by its integration time; without errors where the calibration has a drift and nothing else.
fn models_of(set: &ModelSet, view: &View, drifts: bool) -> Result<Vec<InterpolatedModel>> {
    let without_errors = |interval_m: f64| RangeErrorModel::error_free(interval_m).into();
    match (view.integration_time_s, set.entries.as_slice()) {
        (_, []) if drifts => {
            // Without a frequency: any interval does, as nothing depends on the phase.
            let intervals = view.modulations.iter().map(range_image::Modulation::ambiguity_interval_m);
            let count = view.channels.len().max(1);
            Ok(intervals.chain(std::iter::repeat(1.0)).take(count).map(without_errors).collect())
        }
        (Some(time), _) => set.at(time).map_err(Error::stage("CorrectRange", &view.name())),
        (None, [(_, models)]) => Ok(models.iter().cloned().map(InterpolatedModel::from).collect()),
        (None, _) => {
            let message = "the survey states no integration time, which the calibration's models are chosen by";
            Err(Error::unfit("CorrectRange", &view.name(), message))
        }
    }
}

fn reference_drift(
    view: &mut View,
    path: &ReferencePath,
    models: &[InterpolatedModel],
    sensor: &reference_path::Sensor<'_>,
) -> Result<ViewDrift> {
    let (name, modulations) = (view.name(), view.modulations.clone());
    let frames = frames_with_models(view, models)?;
    let modulations = modulations.into_iter().map(Some).chain(std::iter::repeat(None));
    let frames: Vec<_> =
        frames.into_iter().zip(modulations).map(|((frame, model), modulation)| (&*frame, model, modulation)).collect();
    reference_path::drift(name.clone(), path, &frames, sensor).map_err(Error::stage("CorrectRange", &name))
}

fn findings(outside: usize, drifts: &[ViewDrift]) -> Findings {
    let mut findings = Findings::from([("pixels_outside_span".to_owned(), outside as f64)]);
    if !drifts.is_empty() {
        let mean = drifts.iter().map(|drift| drift.drift_m).sum::<f64>() / drifts.len() as f64;
        findings.insert("drift_m".to_owned(), mean);
        let largest = drifts.iter().map(|drift| drift.sigma_m).fold(0.0, f64::max);
        findings.insert("drift_sigma_m".to_owned(), largest);
    }
    findings
}

/// Each frequency's ranges with that frequency's model; the one frame where frequencies are not apart.
fn frames_with_models<'a>(
    view: &'a mut View,
    models: &'a [InterpolatedModel],
) -> Result<Vec<(&'a mut RangeFrame, &'a InterpolatedModel)>> {
    let name = view.name();
    if !view.channels.is_empty() {
        if view.channels.len() != models.len() {
            let message =
                format!("{} frequencies, but the calibration has models for {}", view.channels.len(), models.len());
            return Err(Error::unfit("CorrectRange", &name, message));
        }
        return Ok(view.channels.iter_mut().zip(models).collect());
    }
    match (&mut view.data, models) {
        (ViewData::Range(frame), [model]) => Ok(vec![(frame, model)]),
        (ViewData::Range(_), models) => {
            let message = format!("one range, but the calibration has models for {} frequencies", models.len());
            Err(Error::unfit("CorrectRange", &name, message))
        }
        _ => Err(Error::Needs { stage: "CorrectRange", needs: "Unwrap" }),
    }
}
