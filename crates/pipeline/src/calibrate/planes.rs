//! Range terms from frames of known planes.

use camera_model::Camera;
use error_models::{AmplitudeHyperbola, ParameterStatus, RangeTerms};
use nalgebra::{DMatrix, DVector, Point3, Vector3};
use range_image::Modulation;
use range_io::survey::{Level, Survey};
use range_io::tables::{ObservedPlane, PlacedRows, read_placed_planes};
use self_calibration::Error as Cause;
use self_calibration::{
    CalibratedParameter, CalibrationOutcome, Component, DifferenceOptions, GroupQuality, Method, ObservationQuality,
    Plane, RangeCalibration, RangeDifference, RangeTermOptions, Scale, TermSelection, TermUse, Verdict,
    differences_to_plane, estimate_range_terms,
};

use super::request::CalibrateRequest;
use super::run::Attempt;
use super::start::Start;
use super::summary::PARAMETERS;
use crate::load::root_of;
use crate::outcome::Outcome;
use crate::progress::Progress;
use crate::view::{View, ViewData};
use crate::{AverageOptions, DeconvolveOptions, DemodulateOptions, Error, Plan, Result, Stage, UnwrapOptions, process};

/// Differences used of all frames together. More pixels of the same planes would not tell more, as they share the
/// errors of the reference, and would make the report heavy.
const MOST_DIFFERENCES: usize = 20_000;

/// Gross error in standard deviations of its residual that a test with a level of 0.1 % finds with a power of 80 %.
const NONCENTRALITY: f64 = 4.13;

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
            let known = format!("{}, h1, h2, h3", RangeTerms::NAMES.join(", "));
            let what = "the list of terms for planes".to_owned();
            let kind = "term";
            return Err(Error::Calibrate(Cause::UnknownName { what, kind, name: name.clone(), known }));
        };
        options.terms[index] = TermUse::Estimate;
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
    let covariance = estimate.covariance(Scale::Prior)?;
    let quality = |(sample, v): (&Sample, &f64)| quality(sample, *v, estimate, &covariance);
    let residuals = estimate.residuals_m();
    let used = samples.len();
    let unknowns = estimate.estimated_names().len();
    let vtpv: f64 = samples.iter().zip(residuals).map(|(s, v)| (v / s.difference.sigma_m).powi(2)).sum();
    let (n, k) = (used as f64, unknowns as f64);
    Ok(CalibrationOutcome {
        method: Method::Laboratory,
        camera: start.camera,
        range_models: vec![(time, estimate.model().clone())],
        parameters: parameters(start, estimate)?,
        estimated: estimate.estimated_names().to_vec(),
        covariance: covariance.clone(),
        stations: Vec::new(),
        targets: Vec::new(),
        residuals: samples.iter().zip(residuals).map(quality).collect(),
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

/// Camera parameters are held, range terms as the estimate has them.
fn parameters(start: &Start, estimate: &RangeCalibration) -> self_calibration::Result<Vec<CalibratedParameter>> {
    let posterior = estimate.parameters(Scale::Posterior)?;
    let prior = estimate.parameters(Scale::Prior)?;
    let ranges = prior.into_iter().zip(posterior).map(|(prior, posterior)| CalibratedParameter {
        name: prior.name,
        value: prior.value,
        sigma_prior: prior.sigma,
        sigma_posterior: posterior.sigma,
        unit: prior.unit,
        status: prior.status,
        significance_p: f64::NAN,
    });
    let camera = camera_values(&start.camera).into_iter().zip(PARAMETERS);
    let held = camera.map(|(value, (name, unit))| CalibratedParameter {
        name: name.to_owned(),
        value,
        sigma_prior: 0.0,
        sigma_posterior: 0.0,
        unit: unit.to_owned(),
        status: ParameterStatus::Held,
        significance_p: f64::NAN,
    });
    Ok(held.chain(ranges).collect())
}

/// Interior orientation and lens in the order of the summary.
fn camera_values(camera: &Camera) -> Vec<f64> {
    let [xp, yp] = camera.interior.principal_point_mm;
    [xp, yp, camera.interior.principal_distance_mm].into_iter().chain(camera.lens.coefficients()).collect()
}

/// A sample after the estimation. Its redundancy number is `1 - a Q aᵀ / σ²` with its design row a.
fn quality(
    sample: &Sample,
    residual: f64,
    estimate: &RangeCalibration,
    covariance: &DMatrix<f64>,
) -> ObservationQuality {
    let difference = &sample.difference;
    let row = design_row(estimate, difference);
    let redundancy = 1.0 - row.dot(&(covariance * &row)) / difference.sigma_m.powi(2);
    let scale = estimate.sigma0().unwrap_or(f64::NAN);
    ObservationQuality {
        station: sample.station.clone(),
        target: sample.plane.clone(),
        component: Component::Range,
        observed: difference.observed_range_m,
        sigma: difference.sigma_m,
        residual,
        redundancy_number: redundancy,
        standardised: residual / (scale * difference.sigma_m * redundancy.sqrt()),
        smallest_detectable: NONCENTRALITY * difference.sigma_m / redundancy.sqrt(),
        verdict: Verdict::Used,
        pixel: sample.pixel,
        range_m: difference.observed_range_m,
        amplitude: difference.amplitude,
        uncorrected_m: difference.observed_range_m - difference.reference_range_m,
    }
}

/// Derivatives of the correction by the estimated parameters.
fn design_row(estimate: &RangeCalibration, difference: &RangeDifference) -> DVector<f64> {
    let model = estimate.model();
    let interval = model.ambiguity_interval_m;
    let terms = RangeTerms::design_row(interval, difference.observed_range_m, difference.x_mm, difference.y_mm);
    let hyperbola = model.hyperbola.and_then(|hyperbola| hyperbola.jacobian(difference.amplitude));
    let hyperbola = hyperbola.map_or([0.0; 3], |jacobian| jacobian.coefficients);
    let named = RangeTerms::NAMES.into_iter().zip(terms).chain(AmplitudeHyperbola::NAMES.into_iter().zip(hyperbola));
    let named: Vec<(&str, f64)> = named.collect();
    let value = |name: &String| named.iter().find(|(known, _)| known == name).map_or(0.0, |(_, value)| *value);
    DVector::from_iterator(estimate.estimated_names().len(), estimate.estimated_names().iter().map(value))
}
