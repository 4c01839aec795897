//! On the job: terms and poses from what the stations of an ordinary survey see in common, without a target.

mod surfaces_outcome;

use commands::plan::{FlagOptions, Stage, to_ranges};
use commands::{Progress, root_of};
use multiview_registration::Datum;
use pipeline::survey::{View, ViewData, ViewDrift};
use pipeline::{Error, Plan, Result, process};
use range_calibration::{
    SurfaceCalibration, SurfaceCalibrationOptions, SurfaceCapture, SurfaceTerm, calibrate_surfaces,
};
use range_image::RangeFrame;
use range_io::survey::Survey;
use range_io::tables::{Station, read_placed_stations};
use self_calibration::{Error as Cause, TermSelection};

use crate::calibrate::network::network_files::optional;
use crate::calibrate::planes::attempt::{Attempt, Calibrated};
use crate::calibrate::request::CalibrateRequest;
use crate::calibrate::start::Start;
use crate::calibrate::start::drift::KnownDrift;

/// Standard deviation of waves and tilt of the range error that cameras show before they are calibrated, metre.
const USUAL_WAVE_M: f64 = 0.02;
/// Integration times that differ by a smaller part are one.
const SAME_TIME: f64 = 1e-3;
/// Terms of the automatic choice that the surfaces of rooms determine, apart from the hyperbola.
const USUAL_RANGE_TERMS: [&str; 9] = ["d0", "d2", "d3", "d4", "d5", "d6", "d7", "e1", "e2"];
/// Parameters of the camera in the automatic choice.
const USUAL_LENS: [&str; 7] = ["xp", "yp", "c", "k1", "k2", "p1", "p2"];

/// Calibrates range terms, and what the surfaces tell of the lens, of a survey of overlapping stations.
pub(crate) fn calibrate_on_the_job(request: &CalibrateRequest, progress: &dyn Progress) -> Result<Attempt> {
    let survey = Survey::read(&request.survey)?;
    let root = root_of(&request.survey);
    let mut start = Start::read(&survey, &root, request.calibration.as_deref())?;
    let stations = optional(&root.join("stations.csv"), read_placed_stations)?.rows;
    let restores = start.calibration.as_ref().is_some_and(|calibration| calibration.scattering.is_some());
    let mut stages = to_ranges(survey.level, restores);
    stages.push(Stage::Flag(FlagOptions::default()));
    let plan = Plan { name: "surfaces".to_owned(), source: None, calibrate: None, stages };
    let processed = process(&plan, &request.survey, request.calibration.as_deref(), progress)?;
    let mut times = processed.views.iter().filter_map(|view| view.integration_time_s);
    if let Some(first) = times.next()
        && let Some(other) = times.find(|time| (time / first - 1.0).abs() > SAME_TIME)
    {
        let message = format!(
            "has frames of {first} s and of {other} s integration time: range terms belong to one time; list the frames of one in a \
             survey of their own"
        );
        return Err(Error::Survey { path: root.join(Survey::FILE_NAME), message });
    }
    let known_drift = KnownDrift::new(start.calibration.as_ref(), &survey, &root, request.warm_up)?;
    let (frames, drifts) = frames(&processed.views, &known_drift, request.defaults.sigma_range_m)?;
    start.set_drifts(drifts);
    let captures = captures(&frames, &stations);
    let options = SurfaceCalibrationOptions { terms: terms(request, &start), ..SurfaceCalibrationOptions::default() };
    // Positions are those of the survey where it has them all; else the first station stands in the origin.
    let placed = captures.iter().all(|capture| capture.world_from_camera.is_some());
    let datum = if placed { Datum::InnerConstraints } else { Datum::Station(0) };
    progress.begin("register with the terms", 1);
    let found = calibrate_surfaces(&captures, &start.camera, &start.range_model, datum, &options, &|_, _| {});
    progress.advance(1);
    let time = processed.views.first().and_then(|view| view.integration_time_s);
    let time = time.or(request.defaults.integration_time_s);
    let calibrated = found.map_err(Cause::from).and_then(|found: SurfaceCalibration| {
        let outcome = surfaces_outcome::outcome(&found, &captures, &start, time)?;
        Ok(Calibrated { outcome, table: None, check: None })
    });
    Ok((start, calibrated))
}

/// A station's name and ranges, freed of a known drift.
struct StationFrame {
    name: String,
    frame: RangeFrame,
}

fn frames(
    views: &[View],
    known_drift: &KnownDrift<'_>,
    sigma_range_m: Option<f64>,
) -> Result<(Vec<StationFrame>, Vec<ViewDrift>)> {
    let mut drifts: Vec<ViewDrift> = Vec::new();
    let mut frames = Vec::with_capacity(views.len());
    for view in views {
        let ViewData::Range(frame) = &view.data else {
            return Err(Error::Needs { stage: "surfaces", needs: "Unwrap" });
        };
        let mut frame = RangeFrame::clone(frame);
        let drift = known_drift.of_frames(&view.station, &view.frames)?;
        if let Some(drift) = &drift {
            frame.range.as_mut_slice().iter_mut().for_each(|range| *range -= drift.drift_m as f32);
        }
        drifts.extend(drift.filter(|drift| !drifts.contains(drift)));
        if let Some(sigma_m) = sigma_range_m {
            for sigma in frame.sigma.as_mut_slice().iter_mut().filter(|sigma| sigma.is_nan() || **sigma <= 0.0) {
                *sigma = sigma_m as f32;
            }
        }
        frames.push(StationFrame { name: view.station.clone(), frame });
    }
    Ok((frames, drifts))
}

fn captures<'a>(frames: &'a [StationFrame], stations: &[Station]) -> Vec<SurfaceCapture<'a>> {
    let pose = |name: &str| stations.iter().find(|station| station.station == name).map(|s| s.world_from_camera);
    let capture =
        |of: &'a StationFrame| SurfaceCapture { name: &of.name, frame: &of.frame, world_from_camera: pose(&of.name) };
    frames.iter().map(capture).collect()
}

/// The terms asked for, with what is known of them: by the calibration that was given, or by what cameras show.
fn terms(request: &CalibrateRequest, start: &Start) -> Vec<SurfaceTerm> {
    let names: Vec<String> = match &request.options.terms {
        TermSelection::List(names) => names.clone(),
        TermSelection::Auto => {
            let lens = USUAL_LENS.into_iter().filter(|name| !is_held(start, name));
            USUAL_RANGE_TERMS.into_iter().chain(["h1"]).chain(lens).map(str::to_owned).collect()
        }
    };
    let half_mm = 0.5 * start.camera.format.width as f64 * start.camera.format.pixel_pitch_mm[0];
    let prior = |name: &str| {
        let known = start.calibration.as_ref().and_then(|known| known.parameter(name)).map(|known| known.sigma);
        match (known.filter(|sigma| *sigma > 0.0), name) {
            // What the lens is was found with targets, and surfaces tell little of it.
            (Some(sigma), name) if USUAL_LENS.contains(&name) => sigma,
            (_, "d2" | "d3" | "d4" | "d5" | "d6" | "d7") => USUAL_WAVE_M,
            (_, "e1" | "e2") => USUAL_WAVE_M / half_mm,
            _ => f64::INFINITY,
        }
    };
    names.into_iter().map(|name| SurfaceTerm { prior_sigma: prior(&name), name }).collect()
}

/// Whether a calibration gives a parameter of the camera as exact.
fn is_held(start: &Start, name: &str) -> bool {
    let known = start.calibration.as_ref().map(|known| known.parameter(name).map_or(0.0, |parameter| parameter.sigma));
    known.is_some_and(|sigma| sigma == 0.0)
}
