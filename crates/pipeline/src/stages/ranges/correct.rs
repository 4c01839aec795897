use std::sync::Arc;

use error_models::{FixedPattern, InterpolatedModel, ModelSet, RangeErrorModel};
use range_image::{ImageFormat, RangeFrame};
use range_io::calibration::ValidSpan;
use range_io::survey::{ReferencePath, Survey};

use crate::stages::line::Making;
use crate::stages::ranges::reference_path;
use crate::stages::{Findings, Found, ViewStage};
use crate::survey::compatible::model_set;
use crate::survey::correction_record::CorrectionRecord;
use crate::survey::drift::{DriftCurve, ViewDrift};
use crate::survey::open::OpenSurvey;
use crate::survey::view::{View, ViewData};
use crate::{Error, Result};
use commands::plan::{CorrectRangeOptions, DriftTreatment};

/// Drift, range terms, amplitude-related error and fixed pattern are taken off, frequency by frequency.
pub(crate) struct CorrectRange {
    survey: Arc<Survey>,
    set: ModelSet,
    format: ImageFormat,
    principal_point_mm: [f64; 2],
    pattern: Option<Arc<FixedPattern>>,
    span: ValidSpan,
    /// Whether the drift is taken off, by the optical reference or by the calibrated curve.
    applies_drift: bool,
    curve: Option<DriftCurve>,
    /// Whether there is a drift at all.
    drifts: bool,
}

impl CorrectRange {
    pub(crate) fn new(options: &CorrectRangeOptions, making: &Making<'_>) -> Result<Self> {
        let OpenSurvey { survey, calibration, calibrated_camera, .. } = making.survey;
        let Some(calibration) = calibration else {
            return Err(Error::Camera(
                "stage CorrectRange needs a calibration; name one with --calibration".to_owned(),
            ));
        };
        let camera = calibrated_camera.unwrap_or(making.camera);
        let applies_drift = options.warm_up == DriftTreatment::Apply;
        let reference = survey.reference_path.is_some();
        let calibrated = calibration.warm_up.as_ref().filter(|_| applies_drift && !reference);
        let curve = calibrated.map(|calibrated| DriftCurve::new(calibrated, survey)).transpose();
        Ok(Self {
            survey: Arc::clone(survey),
            set: model_set(survey, calibration)?,
            format: camera.format,
            principal_point_mm: camera.interior.principal_point_mm,
            pattern: calibration.fixed_pattern.clone().map(Arc::new),
            span: calibration.span,
            applies_drift,
            curve: curve.map_err(Error::stage("CorrectRange", "calibration"))?,
            drifts: calibration.warm_up.is_some() || reference,
        })
    }

    fn drift(&self, view: &mut View, models: &[InterpolatedModel]) -> Result<Option<ViewDrift>> {
        let name = view.name();
        match (&self.survey.reference_path, &self.curve) {
            (Some(path), _) if self.applies_drift => {
                let (format, principal_point_mm) = (self.format, self.principal_point_mm);
                let sensor = reference_path::Sensor { format, principal_point_mm, pattern: self.pattern.as_deref() };
                reference_drift(view, path, models, &sensor).map(Some)
            }
            (_, Some(curve)) => {
                curve.of_view(view, &self.survey).map(Some).map_err(Error::stage("CorrectRange", &name))
            }
            _ => Ok(None),
        }
    }
}

impl ViewStage for CorrectRange {
    fn apply(&self, view: &mut View, found: &mut Found) -> Result<()> {
        let name = view.name();
        let mut models = models_of(&self.set, view, self.drifts)?;
        let drift = self.drift(view, &models)?;
        if let Some(drift) = &drift {
            for model in &mut models {
                model.add_offset(drift.drift_m);
            }
            found.drifts.push(drift.clone());
        }
        let (format, point_mm) = (self.format, self.principal_point_mm);
        let mut record = CorrectionRecord::new(format, point_mm, self.pattern.clone(), drift, self.span);
        for (frame, model) in frames_with_models(view, &models)? {
            let (observed, sigma) = (frame.range.clone(), frame.sigma.clone());
            let summary = model.correct_frame(frame, &format, point_mm, self.pattern.as_deref());
            found.span.flag(&self.span, &observed, frame);
            found.add("pixels_outside_span", summary.map_err(Error::stage("CorrectRange", &name))?.outside_span);
            if let Some(path) = &self.survey.reference_path {
                reference_path::mask(path, frame);
            }
            record.add(model, observed, sigma, frame);
        }
        view.correction = Some(record);
        view.combine_channels()
    }

    fn findings(&self, found: &Found) -> Findings {
        let (mut findings, drifts) = (found.sums.clone(), &found.drifts);
        if !drifts.is_empty() {
            let mean = drifts.iter().map(|drift| drift.drift_m).sum::<f64>() / drifts.len() as f64;
            findings.insert("drift_m".to_owned(), mean);
            let largest = drifts.iter().map(|drift| drift.sigma_m).fold(0.0, f64::max);
            findings.insert("drift_sigma_m".to_owned(), largest);
        }
        findings
    }
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
