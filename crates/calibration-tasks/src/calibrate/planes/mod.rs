//! Range terms from frames of planes, known or not.

pub(crate) mod attempt;
pub(crate) mod offset;
pub(crate) mod placed;
pub(crate) mod planes_outcome;
pub(crate) mod pose_test;

use commands::plan::to_ranges;
use commands::{Progress, root_of};
use error_models::{RangeTerms, SurfaceShape};
use nalgebra::{Isometry3, Point3, Vector3};
use pipeline::run::Processed;
use pipeline::survey::{ViewData, ViewDrift};
use pipeline::{Error, Plan, Result, process};
use range_calibration::{
    DifferenceOptions, Plane, PlaneCalibrationOptions, PlaneCapture, RangeDifference, RangeTermOptions, TermUse,
    estimate_range_terms,
};
use range_io::survey::{Level, Survey};
use range_io::tables::{ObservedPlane, PlacedRows, Station, read_placed_planes, read_placed_stations};
use self_calibration::{Error as Cause, NetworkError, TermSelection};

use crate::calibrate::network::network_files::optional;
use crate::calibrate::planes::attempt::{Attempt, Calibrated};
use crate::calibrate::planes::offset::FoundTable;
use crate::calibrate::planes::placed::Placed;
use crate::calibrate::planes::planes_outcome::Found;
use crate::calibrate::request::{CalibrateRequest, OffsetModel};
use crate::calibrate::start::Start;
use crate::calibrate::start::drift::KnownDrift;

/// Differences used of all frames together. More pixels of the same planes would not tell more, as they share the
/// errors of the reference, and would make the report heavy.
const MOST_DIFFERENCES: usize = 20_000;

/// Calibrates the range terms of a survey with `planes.csv`.
///
/// Where all planes and poses are known, every pixel is a range difference. Otherwise planes, or poses within their
/// standard deviations, are found together with the terms.
pub(crate) fn calibrate_planes(request: &CalibrateRequest, progress: &dyn Progress) -> Result<Attempt> {
    let survey = Survey::read(&request.survey)?;
    let root = root_of(&request.survey);
    let mut start = Start::read(&survey, &root, request.calibration.as_deref())?;
    let rows = read_placed_planes(root.join("planes.csv"))?;
    if rows.rows.is_empty() {
        let message = "has no rows, expected the planes that the stations see".to_owned();
        return Err(Error::Survey { path: rows.file().to_owned(), message });
    }
    let options = term_options(request, &start)?;
    let stations = optional(&root.join("stations.csv"), read_placed_stations)?.rows;
    let frames = process(&preparation(&survey, &start), &request.survey, request.calibration.as_deref(), progress)?;
    let known_drift = KnownDrift::new(start.calibration.as_ref(), &survey, &root, request.warm_up)?;
    let scene = Scene::new(&rows, &frames, &stations, &known_drift, request.defaults.sigma_range_m)?;
    start.set_drifts(scene.drifts.clone());
    progress.begin("estimate range terms", 1);
    let time = frames.views.first().and_then(|view| view.integration_time_s);
    let time = time.or(request.defaults.integration_time_s);
    let rewraps = scene.is_known() && survey.level <= Level::Phase;
    let found = if scene.is_known() {
        known(&rows, &scene, &start, &options, rewraps)?
    } else {
        let rejection = request.options.rejection_level.and(PlaneCalibrationOptions::default().rejection);
        unknown(&scene, &start, &options, rejection)
    };
    let outcome = found.and_then(|(found, placed)| {
        let doubts = pose_test::doubts(&placed, &found, &start);
        let table = match request.offset {
            OffsetModel::Table { block } => {
                let pixels = DifferenceOptions { step: 1, ..scene.pixels() };
                Some(FoundTable::new(&placed, found.model(), &start, &pixels, rewraps, block)?)
            }
            OffsetModel::Constant | OffsetModel::Surface { .. } => None,
        };
        let mut outcome = found.outcome(&start, time);
        outcome.diagnosis.extend(scene.assumptions());
        outcome.doubts.extend(doubts);
        outcome.doubts.extend(outcome.doubts_of_tests());
        Ok(Calibrated { outcome, table, check: None })
    });
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
    /// Standard deviation of ranges whose frames state none, where it was given, metre.
    sigma_range_m: Option<f64>,
}

impl<'a> Scene<'a> {
    fn new(
        rows: &PlacedRows<ObservedPlane>,
        frames: &'a Processed,
        stations: &[Station],
        known_drift: &KnownDrift<'_>,
        sigma_range_m: Option<f64>,
    ) -> Result<Self> {
        let (captures, names, planes, drifts) = Default::default();
        let mut scene = Self { captures, names, planes, drifts, sigma_range_m };
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
                covariance: station.and_then(Station::covariance),
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
        let unknown_sigma_m = self.sigma_range_m.unwrap_or(DifferenceOptions::default().unknown_sigma_m);
        DifferenceOptions { step, unknown_sigma_m, ..DifferenceOptions::default() }
    }

    /// What was taken for granted, in sentences.
    fn assumptions(&self) -> Vec<String> {
        let unknown = |capture: &&PlaneCapture<'_>| {
            capture.frame.sigma.as_slice().iter().all(|sigma| !(*sigma > 0.0 && sigma.is_finite()))
        };
        let unknown = self.captures.iter().filter(unknown).count();
        let millimetres = 1e3 * self.pixels().unknown_sigma_m;
        let sigma = (unknown > 0 && self.sigma_range_m.is_none()).then(|| {
            format!(
                "the frames of {unknown} of {} captures state no standard deviation of their ranges: {millimetres} mm is \
                 assumed; give it with --sigma-range",
                self.captures.len()
            )
        });
        let exact = self.captures.iter().filter(|c| c.world_from_camera.is_some() && c.covariance.is_none()).count();
        let exact = (exact > 0).then(|| {
            format!(
                "the poses of {exact} of {} captures have no standard deviations in stations.csv and are taken as exact",
                self.captures.len()
            )
        });
        sigma.into_iter().chain(exact).collect()
    }
}

fn plane_of((normal, d): ([f64; 3], f64)) -> std::result::Result<Plane, primitives::Error> {
    let normal = Vector3::from(normal);
    Plane::new(&normal, &Point3::from(normal * (d / normal.norm_squared())))
}

/// What was found, and with which planes and poses.
type FoundWith<'a> = std::result::Result<(Found, Vec<Placed<'a>>), Cause>;

/// Range terms from differences to known planes.
fn known<'a>(
    rows: &PlacedRows<ObservedPlane>,
    scene: &'a Scene<'_>,
    start: &Start,
    options: &RangeTermOptions,
    rewraps: bool,
) -> Result<FoundWith<'a>> {
    let (mut samples, mut all) = (Vec::new(), Vec::new());
    for (index, capture) in scene.captures.iter().enumerate() {
        let (Some(plane), Some(pose)) = (scene.planes[capture.plane], capture.world_from_camera) else { continue };
        let placed = Placed { capture, name: scene.names[capture.plane].clone(), plane, pose };
        let more = placed.samples(start, &scene.pixels(), rewraps);
        let more = more.map_err(Error::stage("planes", &capture.name))?;
        if more.is_empty() {
            let reason = format!("no usable pixel of station `{}` sees the plane", capture.name);
            return Err(rows.error(index, "plane", reason).into());
        }
        samples.extend(more);
        all.push(placed);
    }
    let differences: Vec<RangeDifference> = samples.iter().map(|sample| sample.difference).collect();
    let estimate = estimate_range_terms(&differences, start.range_model.ambiguity_interval_m, options);
    let found = estimate.and_then(|estimate| Found::of_differences(samples, &estimate));
    Ok(found.map(|found| (found, all)).map_err(Cause::from))
}

/// Range terms together with planes that are not known, or poses that are known within their standard deviations.
fn unknown<'a>(
    scene: &'a Scene<'_>,
    start: &Start,
    options: &RangeTermOptions,
    rejection: Option<f64>,
) -> FoundWith<'a> {
    let pixels = scene.pixels();
    let options = PlaneCalibrationOptions { terms: *options, pixels, rejection };
    let interval = start.range_model.ambiguity_interval_m;
    let estimate =
        range_calibration::calibrate_planes(&scene.captures, &scene.planes, &start.camera, interval, &options)?;
    let (mut samples, mut all) = (Vec::new(), Vec::new());
    for (capture, quality) in scene.captures.iter().zip(estimate.captures()) {
        let adjusted = &estimate.planes()[quality.plane];
        let pose = quality.world_from_camera.unwrap_or_else(Isometry3::identity);
        let placed = Placed { capture, name: adjusted.name.clone(), plane: adjusted.plane, pose };
        samples.extend(placed.samples(start, &pixels, false)?);
        all.push(placed);
    }
    Ok((Found::of_planes(samples, &estimate, rejection)?, all))
}

/// The stages that bring the survey's frames to unwrapped, uncorrected ranges.
fn preparation(survey: &Survey, start: &Start) -> Plan {
    let restores = start.calibration.as_ref().is_some_and(|calibration| calibration.scattering.is_some());
    Plan { name: "planes".to_owned(), source: None, calibrate: None, stages: to_ranges(survey.level, restores) }
}

/// The named terms are estimated, all others held at the start values. A surface stands instead of e1 and e2.
fn term_options(request: &CalibrateRequest, start: &Start) -> Result<RangeTermOptions> {
    let largest_inflation = request.options.largest_inflation;
    let mut options = RangeTermOptions { largest_inflation, ..RangeTermOptions::default() };
    let surface = if let OffsetModel::Surface { order } = request.offset {
        let principal_point_mm = start.camera.interior.principal_point_mm;
        options = options.with_surface(SurfaceShape::over_image(order, &start.camera.format, principal_point_mm));
        Some(format!("surface{order}"))
    } else {
        None
    };
    let TermSelection::List(names) = &request.options.terms else { return Ok(options) };
    options = options.hold_terms(&start.range_model.terms);
    if let Some(surface) = surface {
        if let Some(name) = names.iter().find(|name| ["e1", "e2"].contains(&name.as_str())) {
            let reason = "a surface over the image has their plane in it";
            let (first, second) = (name.clone(), surface);
            return Err(Error::Calibrate(Cause::ConflictingTerms { first, second, reason }));
        }
        let [.., e1, e2] = &mut options.terms;
        (*e1, *e2) = (TermUse::Estimate, TermUse::Estimate);
    }
    for name in names {
        let Some(index) = RangeTerms::NAMES.iter().position(|known| known == name) else {
            if ["h1", "h2", "h3"].contains(&name.as_str()) {
                options = options.with_hyperbola();
                continue;
            }
            let known = format!("{}, h1, h2, h3", RangeTerms::NAMES.join(", "));
            let what = "the list of terms for planes".to_owned();
            let kind = "term";
            return Err(Error::Calibrate(NetworkError::UnknownName { what, kind, name: name.clone(), known }.into()));
        };
        options.terms[index] = TermUse::Estimate;
    }
    Ok(options)
}
