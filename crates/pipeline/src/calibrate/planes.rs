//! Range terms from frames of known planes.

use std::path::Path;

use adjust::Scale;
use error_models::RangeTerms;
use nalgebra::{DMatrix, Point3, Vector3};
use range_image::Modulation;
use range_io::survey::{Level, Survey};
use range_io::tables::{ObservedPlane, PlacedRows, read_placed_planes};
use self_calibration::{
    CalibratedParameter, CalibrationOutcome, Component, DifferenceOptions, GroupQuality, Method, ObservationQuality,
    Plane, RangeCalibration, RangeDifference, RangeTermOptions, TermSelection, Verdict, differences_to_plane,
    estimate_range_terms,
};

use super::request::CalibrateRequest;
use super::run::Attempt;
use super::start::Start;
use crate::load::root_of;
use crate::outcome::Outcome;
use crate::progress::Progress;
use crate::view::{View, ViewData};
use crate::{
    AverageOptions, DeconvolveOptions, DemodulateOptions, Error, Plan, Result, Stage, UnwrapOptions, process,
};

/// Differences used of all frames together. More pixels of the same planes would not tell more, as they share the
/// errors of the reference, and would make the report heavy.
const MOST_DIFFERENCES: usize = 20_000;

/// A range difference and where it was seen.
struct Sample {
    station: String,
    plane: String,
    pixel: [f64; 2],
    difference: RangeDifference,
}

/// Calibrates the range terms of a survey with `planes.csv`.
pub(super) fn calibrate_planes(request: &CalibrateRequest, progress: &dyn Progress) -> Result<Attempt> {
    let survey = Survey::read(&request.survey)?;
    let root = root_of(&request.survey);
    let start = Start::read(&survey, &root, request.calibration.as_deref())?;
    let planes = read_placed_planes(root.join("planes.csv"))?;
    if planes.rows.is_empty() {
        let message = "has no rows, expected the planes that the stations see".to_owned();
        return Err(Error::Survey { path: planes.file().to_owned(), message });
    }
    let options = term_options(&request.options.terms, request.options.largest_inflation, &start)?;
    let frames = process(&preparation(&survey, &start), &request.survey, request.calibration.as_deref(), progress)?;
    let samples = samples(&planes, &frames, &start, survey.level)?;
    let differences: Vec<RangeDifference> = samples.iter().map(|sample| sample.difference).collect();
    progress.begin("estimate range terms", 1);
    let estimate = estimate_range_terms(&differences, start.range_model.ambiguity_interval_m, &options);
    let time = frames.views.first().and_then(|view| view.integration_time_s);
    let outcome = estimate.and_then(|estimate| outcome(&start, &samples, time, &estimate));
    progress.advance(1);
    Ok((start, outcome))
}

/// The stages that bring the survey's frames to unwrapped, uncorrected ranges.
fn preparation(survey: &Survey, start: &Start) -> Plan {
    let mut stages = Vec::new();
    if survey.level == Level::Samples {
        stages.push(Stage::Demodulate(DemodulateOptions::default()));
    }
    stages.push(Stage::Average(AverageOptions::default()));
    if survey.level <= Level::Phase {
        if start.calibration.as_ref().is_some_and(|calibration| calibration.scattering.is_some()) {
            stages.push(Stage::Deconvolve(DeconvolveOptions::default()));
        }
        stages.push(Stage::Unwrap(UnwrapOptions::default()));
    }
    Plan { name: "planes".to_owned(), source: None, stages }
}

/// The named terms are estimated, all others held at the start values.
fn term_options(terms: &TermSelection, largest_inflation: f64, start: &Start) -> Result<RangeTermOptions> {
    let mut options = RangeTermOptions { largest_inflation, ..RangeTermOptions::default() };
    let TermSelection::List(names) = terms else { return Ok(options) };
    options = options.hold_terms(&start.range_model.terms);
    for name in names {
        let Some(index) = RangeTerms::NAMES.iter().position(|known| known == name) else {
            if ["h1", "h2", "h3"].contains(&name.as_str()) {
                options = options.with_hyperbola();
                continue;
            }
            return Err(Error::Calibrate(format!(
                "--terms: `{name}` can't be found from planes; these can: {}, h1, h2, h3",
                RangeTerms::NAMES.join(", ")
            )));
        };
        options.terms[index] = self_calibration::TermUse::Estimate;
    }
    Ok(options)
}

fn samples(planes: &PlacedRows<ObservedPlane>, frames: &Outcome, start: &Start, level: Level) -> Result<Vec<Sample>> {
    let step = step(frames, planes.rows.len());
    let mut samples = Vec::new();
    for (index, row) in planes.rows.iter().enumerate() {
        let plane = known_plane(planes, index)?;
        let view = frames.views.iter().find(|view| view.station == row.station).ok_or_else(|| {
            planes.error(index, "station", format!("`{}` is no station of the survey's frames", row.station))
        })?;
        let found = view_samples(view, row, &plane, start, step)?;
        let place = samples.len();
        samples.extend(found);
        if level <= Level::Phase {
            samples[place..].iter_mut().for_each(|sample| rewrap(&mut sample.difference, start.modulation));
        }
        if samples.len() == place {
            let reason = format!("no usable pixel of station `{}` sees the plane", row.station);
            return Err(planes.error(index, "plane", reason).into());
        }
    }
    Ok(samples)
}

fn known_plane(planes: &PlacedRows<ObservedPlane>, index: usize) -> Result<Plane> {
    let Some((normal, d)) = planes.rows[index].known else {
        let reason = "is empty: planes that are not known can't be used without known stations and targets";
        return Err(planes.error(index, "nx", reason).into());
    };
    let normal = Vector3::from(normal);
    let point = Point3::from(normal * (d / normal.norm_squared()));
    Plane::new(&normal, &point).map_err(|error| planes.error(index, "nx", error.to_string()).into())
}

/// Every so many columns and rows, for all planes to stay below the number of differences worth having.
fn step(frames: &Outcome, planes: usize) -> usize {
    let pixels = frames.views.first().map_or(0, |view| view.size().0 * view.size().1) * planes;
    ((pixels as f64 / MOST_DIFFERENCES as f64).sqrt().ceil() as usize).max(1)
}

fn view_samples(view: &View, row: &ObservedPlane, plane: &Plane, start: &Start, step: usize) -> Result<Vec<Sample>> {
    let ViewData::Range(frame) = &view.data else {
        return Err(Error::Needs { stage: "planes", needs: "Unwrap" });
    };
    let Some(pose) = view.approximate_world_from_camera else {
        let message = format!("stations.csv has no pose of station `{}`, which a known plane needs", view.station);
        return Err(Error::Camera(message));
    };
    let options = DifferenceOptions { step, ..DifferenceOptions::default() };
    let differences = differences_to_plane(frame, &start.camera, &pose, plane, &options);
    let differences = differences.map_err(Error::stage("planes", &view.name()))?;
    let format = start.camera.format;
    let [xp, yp] = start.camera.interior.principal_point_mm;
    let sample = |difference: RangeDifference| Sample {
        station: view.station.clone(),
        plane: row.plane.clone(),
        pixel: format.pixel_from_image([difference.x_mm + xp, difference.y_mm + yp]),
        difference,
    };
    Ok(differences.into_iter().map(sample).collect())
}

/// The reference tells the number of whole intervals better than the phases could.
fn rewrap(difference: &mut RangeDifference, modulation: Modulation) {
    let interval = modulation.ambiguity_interval_m();
    let intervals = ((difference.reference_range_m - difference.observed_range_m) / interval).round();
    difference.observed_range_m += intervals * interval;
}

/// The estimate in the form of a network's outcome.
fn outcome(
    start: &Start,
    samples: &[Sample],
    time: Option<f64>,
    estimate: &RangeCalibration,
) -> self_calibration::Result<CalibrationOutcome> {
    let parameters = parameters(estimate)?;
    let residuals = estimate.residuals_m();
    let used = samples.len();
    let unknowns = estimate.estimated_names().len();
    let vtpv: f64 = samples.iter().zip(residuals).map(|(s, v)| (v / s.difference.sigma_m).powi(2)).sum();
    let (n, k) = (used as f64, unknowns as f64);
    Ok(CalibrationOutcome {
        method: Method::Laboratory,
        camera: start.camera,
        range_models: vec![(time, estimate.model().clone())],
        parameters,
        estimated: estimate.estimated_names().to_vec(),
        covariance: estimate.covariance(Scale::Prior)?,
        stations: Vec::new(),
        targets: Vec::new(),
        residuals: samples.iter().zip(residuals).map(|(sample, v)| quality(sample, *v, estimate)).collect(),
        groups: vec![GroupQuality {
            name: "range".to_owned(),
            observations: used,
            redundancy: n - k,
            rms: estimate.rms_after_m(),
            sigma0: estimate.sigma0(),
        }],
        decisions: Vec::new(),
        diagnosis: Vec::new(),
        observations: used,
        unknowns,
        datum_defect: 0,
        redundancy: estimate.redundancy(),
        vtpv,
        sigma0: estimate.sigma0(),
        aic: vtpv + 2.0 * k,
        bic: vtpv + k * n.ln(),
        trace: Vec::new(),
    })
}
