//! Range terms from frames of planes, known or not.

use error_models::RangeTerms;
use nalgebra::{Isometry3, Point3, Vector3};
use range_image::Modulation;
use range_io::survey::{Level, Survey};
use range_io::tables::{ObservedPlane, PlacedRows, Station, read_placed_planes, read_placed_stations};
use self_calibration::Error as Cause;
use self_calibration::{
    DifferenceOptions, Plane, PlaneCalibrationOptions, PlaneCapture, RangeDifference, RangeTermOptions, TermSelection,
    TermUse, differences_to_plane, estimate_range_terms,
};

use super::control::pose_covariance;
use super::drift::KnownDrift;
use super::network_files::optional;
use super::planes_outcome::{Found, Sample};
use super::request::CalibrateRequest;
use super::run::Attempt;
use super::start::Start;
use crate::drift::ViewDrift;
use crate::load::root_of;
use crate::outcome::Outcome;
use crate::progress::Progress;
use crate::view::ViewData;
use crate::{AverageOptions, DeconvolveOptions, DemodulateOptions, Error, Plan, Result, Stage, UnwrapOptions, process};

/// Differences used of all frames together. More pixels of the same planes would not tell more, as they share the
/// errors of the reference, and would make the report heavy.
const MOST_DIFFERENCES: usize = 20_000;

/// Calibrates the range terms of a survey with `planes.csv`.
///
/// Where all planes and poses are known, every pixel is a range difference. Otherwise planes, or poses within their
/// standard deviations, are found together with the terms.
pub(super) fn calibrate_planes(request: &CalibrateRequest, progress: &dyn Progress) -> Result<Attempt> {
    let survey = Survey::read(&request.survey)?;
    let root = root_of(&request.survey);
    let mut start = Start::read(&survey, &root, request.calibration.as_deref())?;
    let rows = read_placed_planes(root.join("planes.csv"))?;
    if rows.rows.is_empty() {
        let message = "has no rows, expected the planes that the stations see".to_owned();
        return Err(Error::Survey { path: rows.file().to_owned(), message });
    }
    let options = term_options(&request.options.terms, request.options.largest_inflation, &start)?;
    let stations = optional(&root.join("stations.csv"), read_placed_stations)?.rows;
    let frames = process(&preparation(&survey, &start), &request.survey, request.calibration.as_deref(), progress)?;
    let known_drift = KnownDrift::new(start.calibration.as_ref(), &survey, &root, request.warm_up)?;
    let scene = Scene::new(&rows, &frames, &stations, &known_drift)?;
    start.set_drifts(scene.drifts.clone());
    progress.begin("estimate range terms", 1);
    let time = frames.views.first().and_then(|view| view.integration_time_s);
    let outcome = if scene.is_known() {
        known(&rows, &scene, &start, &options, survey.level)?.map(|found| found.outcome(&start, time))
    } else {
        let rejection = request.options.rejection_level.and(PlaneCalibrationOptions::default().rejection);
        unknown(&scene, &start, &options, rejection).map(|found| found.outcome(&start, time))
    };
    progress.advance(1);
    Ok((start, outcome))
}

/// What the rows say, put together: a capture for each row.
struct Scene<'a> {
    captures: Vec<PlaneCapture<'a>>,
    names: Vec<String>,
    planes: Vec<Option<Plane>>,
    /// What was taken off each view.
    drifts: Vec<ViewDrift>,
}

impl<'a> Scene<'a> {
    fn new(
        rows: &PlacedRows<ObservedPlane>,
        frames: &'a Outcome,
        stations: &[Station],
        known_drift: &KnownDrift<'_>,
    ) -> Result<Self> {
        let mut scene = Self { captures: Vec::new(), names: Vec::new(), planes: Vec::new(), drifts: Vec::new() };
        for (index, row) in rows.rows.iter().enumerate() {
            let view = frames.views.iter().find(|view| view.station == row.station).ok_or_else(|| {
                rows.error(index, "station", format!("`{}` is no station of the survey's frames", row.station))
            })?;
            let ViewData::Range(frame) = &view.data else {
                return Err(Error::Needs { stage: "planes", needs: "Unwrap" });
            };
            let station = stations.iter().find(|station| station.station == row.station);
            if station.is_none() && row.known.is_some() {
                let reason = format!("stations.csv has no pose of `{}`, which a known plane needs", row.station);
                return Err(rows.error(index, "station", reason).into());
            }
            let plane = scene.plane(rows, index)?;
            let drift = known_drift.of_frames(&view.station, &view.frames)?;
            let drift_m = drift.as_ref().map_or(0.0, |drift| drift.drift_m);
            scene.drifts.extend(drift.filter(|drift| !scene.drifts.contains(drift)));
            scene.captures.push(PlaneCapture {
                name: view.station.clone(),
                frame,
                world_from_camera: station.map(|station| station.world_from_camera),
                covariance: station.and_then(pose_covariance),
                drift_m,
                plane,
            });
        }
        Ok(scene)
    }

    /// Position of a row's plane in the list; a second row of the same plane must say the same of it.
    fn plane(&mut self, rows: &PlacedRows<ObservedPlane>, index: usize) -> Result<usize> {
        let row = &rows.rows[index];
        let found = row.known.map(|known| plane_of(known).map_err(|error| rows.error(index, "nx", error.to_string())));
        let found = found.transpose()?;
        match self.names.iter().position(|name| *name == row.plane) {
            Some(known) if self.planes[known] == found => Ok(known),
            Some(_) => {
                let reason = format!("`{}` has other numbers here than in an earlier row", row.plane);
                Err(rows.error(index, "nx", reason).into())
            }
            None => {
                self.names.push(row.plane.clone());
                self.planes.push(found);
                Ok(self.names.len() - 1)
            }
        }
    }

    fn is_known(&self) -> bool {
        let posed = |capture: &PlaneCapture<'_>| capture.world_from_camera.is_some() && capture.covariance.is_none();
        self.planes.iter().all(Option::is_some) && self.captures.iter().all(posed)
    }

    /// Every so many columns and rows, so that all captures together stay below the differences worth having.
    fn pixels(&self) -> DifferenceOptions {
        let pixels: usize = self.captures.iter().map(|capture| capture.frame.range.as_slice().len()).sum();
        let step = ((pixels as f64 / MOST_DIFFERENCES as f64).sqrt().ceil() as usize).max(1);
        DifferenceOptions { step, ..DifferenceOptions::default() }
    }
}

fn plane_of((normal, d): ([f64; 3], f64)) -> self_calibration::Result<Plane> {
    let normal = Vector3::from(normal);
    Plane::new(&normal, &Point3::from(normal * (d / normal.norm_squared())))
}

/// Range terms from differences to known planes.
fn known(
    rows: &PlacedRows<ObservedPlane>,
    scene: &Scene<'_>,
    start: &Start,
    options: &RangeTermOptions,
    level: Level,
) -> Result<self_calibration::Result<Found>> {
    let mut samples = Vec::new();
    for (index, capture) in scene.captures.iter().enumerate() {
        let (Some(plane), Some(pose)) = (&scene.planes[capture.plane], &capture.world_from_camera) else { continue };
        let mut more = samples_of(capture, &scene.names[capture.plane], plane, pose, start, &scene.pixels())
            .map_err(Error::stage("planes", &capture.name))?;
        if level <= Level::Phase {
            for sample in &mut more {
                rewrap(&mut sample.difference, start.modulation);
            }
        }
        if more.is_empty() {
            let reason = format!("no usable pixel of station `{}` sees the plane", capture.name);
            return Err(rows.error(index, "plane", reason).into());
        }
        samples.extend(more);
    }
    let differences: Vec<RangeDifference> = samples.iter().map(|sample| sample.difference).collect();
    let estimate = estimate_range_terms(&differences, start.range_model.ambiguity_interval_m, options);
    Ok(estimate.and_then(|estimate| Found::of_differences(samples, &estimate)))
}

/// Range terms together with planes that are not known, or poses that are known within their standard deviations.
fn unknown(
    scene: &Scene<'_>,
    start: &Start,
    options: &RangeTermOptions,
    rejection: Option<f64>,
) -> self_calibration::Result<Found> {
    let pixels = scene.pixels();
    let options = PlaneCalibrationOptions { terms: *options, pixels, rejection };
    let interval = start.range_model.ambiguity_interval_m;
    let estimate =
        self_calibration::calibrate_planes(&scene.captures, &scene.planes, &start.camera, interval, &options)?;
    let mut samples = Vec::new();
    for (capture, quality) in scene.captures.iter().zip(estimate.captures()) {
        let adjusted = &estimate.planes()[quality.plane];
        let pose = quality.world_from_camera.unwrap_or_else(Isometry3::identity);
        samples.extend(samples_of(capture, &adjusted.name, &adjusted.plane, &pose, start, &pixels)?);
    }
    Found::of_planes(samples, &estimate, rejection)
}

/// The differences of one capture to a plane, with their pixels.
fn samples_of(
    capture: &PlaneCapture<'_>,
    name: &str,
    plane: &Plane,
    pose: &Isometry3<f64>,
    start: &Start,
    options: &DifferenceOptions,
) -> self_calibration::Result<Vec<Sample>> {
    let differences = differences_to_plane(capture.frame, &start.camera, pose, plane, options)?;
    let format = start.camera.format;
    let [xp, yp] = start.camera.interior.principal_point_mm;
    // The terms are functions of what was observed: the drift goes to the reference.
    let drifted = |difference: RangeDifference| RangeDifference {
        reference_range_m: difference.reference_range_m + capture.drift_m,
        ..difference
    };
    let sample = |difference: RangeDifference| Sample {
        station: capture.name.clone(),
        plane: name.to_owned(),
        pixel: format.pixel_from_image([difference.x_mm + xp, difference.y_mm + yp]),
        drift_m: capture.drift_m,
        difference,
    };
    Ok(differences.into_iter().map(drifted).map(sample).collect())
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
    Plan { name: "planes".to_owned(), source: None, calibrate: None, stages }
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

/// The reference tells the number of whole intervals better than the phases could.
fn rewrap(difference: &mut RangeDifference, modulation: Modulation) {
    let interval = modulation.ambiguity_interval_m();
    let intervals = ((difference.reference_range_m - difference.observed_range_m) / interval).round();
    difference.observed_range_m += intervals * interval;
}
