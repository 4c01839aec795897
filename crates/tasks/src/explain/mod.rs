//! One pixel's way through a pipeline: what each correction did to its range, and what its flags mean.

pub(crate) mod document;
pub(crate) mod flags;
pub(crate) mod parts;

use std::path::PathBuf;

use camera_model::RayTable;
use nalgebra::Vector3;
use range_image::Flags;
use range_io::calibration::Calibration;
use range_io::survey::{Level, Survey};
use serde::Serialize;

use crate::explain::flags::FlagWatch;
use commands::plan::{Stage, is_past};
use commands::{Judged, Progress, root_of};
use pipeline::run::follow_station;
use pipeline::stages::{Line, Watch};
use pipeline::survey::{Purpose, View, ViewData, open, read_calibration};
use pipeline::{Error, Plan, Result};

/// Which pixel is to be explained.
#[derive(Debug, Clone)]
pub struct ExplainRequest {
    /// The survey's folder.
    pub survey: PathBuf,
    /// The frame: its position in the survey, counted from 0, or its file.
    pub frame: String,
    /// Column and row, counted from 0.
    pub pixel: [usize; 2],
    /// The stages; `None`: all that the survey's level and the calibration leave room for.
    pub plan: Option<Plan>,
    /// Calibration file; `None`: the one beside the survey, where there is one.
    pub calibration: Option<PathBuf>,
}

/// What happened to a pixel.
#[derive(Debug, Clone, Serialize)]
pub struct Explanation {
    /// Position of the frame in the survey.
    pub frame: usize,
    /// Its file.
    pub file: String,
    /// Its station.
    pub station: String,
    /// Column and row.
    pub pixel: [usize; 2],
    /// The calibration in use.
    pub calibration: String,
    /// Range as the camera alone gives it, metre: wrapped where it gives phases; `None` where there is none.
    pub raw_range_m: Option<f64>,
    /// What each stage did, in order.
    pub stages: Vec<StageLine>,
    /// Range at the end, metre.
    pub range_m: Option<f64>,
    /// Its standard deviation, metre.
    pub sigma_m: Option<f64>,
    /// Amplitude at the end, in the camera's unit.
    pub amplitude: Option<f64>,
    /// Sum of all changes but whole ambiguity intervals, metre.
    pub moved_m: f64,
    /// Sum of the whole ambiguity intervals that were added, metre.
    pub whole_intervals_m: f64,
    /// The point in the camera's frame, metre (x right, y up, looking along -z).
    pub point_m: Option<[f64; 3]>,
    /// The flags at the end with their reasons.
    pub flags: Vec<FlagReason>,
}

impl Judged for Explanation {}

/// What one stage did to the pixel.
#[derive(Debug, Clone, Serialize)]
pub struct StageLine {
    /// The stage's name.
    pub stage: &'static str,
    /// Range after it minus range before it, metre; `None` where one of the two is missing.
    pub change_m: Option<f64>,
    /// The parts of the change; they add up to it.
    pub parts: Vec<StagePart>,
    /// Range after the stage, metre.
    pub range_m: Option<f64>,
    /// Standard deviation after the stage, metre.
    pub sigma_m: Option<f64>,
}

/// One part of a change.
#[derive(Debug, Clone, Serialize)]
pub struct StagePart {
    /// What did it, in words.
    pub what: String,
    /// What it is summed up with.
    pub group: &'static str,
    /// Change, metre.
    pub change_m: f64,
}

/// Why a pixel carries a flag.
#[derive(Debug, Clone, Serialize)]
pub struct FlagReason {
    /// The flag's name.
    pub flag: &'static str,
    /// The stage that set it; `None`: it came with the frame.
    pub stage: Option<&'static str>,
    /// What it means, with the value and the threshold.
    pub reason: String,
    /// The threshold in standard deviations of what was compared with it, where it can be said so.
    pub threshold_sigmas: Option<f64>,
}

/// The group of whole ambiguity intervals.
pub(crate) const WHOLE_INTERVALS: &str = "whole intervals";

/// A pixel after a stage.
#[derive(Debug, Clone, Copy)]
struct PixelState {
    range_m: Option<f64>,
    sigma_m: Option<f64>,
    amplitude: Option<f64>,
    /// Standard deviation of the amplitude.
    amplitude_sigma: Option<f64>,
    flags: Flags,
}

/// Runs the stages on the station of the frame, watching one pixel. Stages that move whole stations are left out.
///
/// # Errors
/// [`Error::Explain`] for a frame that the survey does not list and a pixel outside the image; [`Error::RuledOut`] for
/// stages that the level of the survey leaves no room for; else what the stages say.
pub fn explain(request: &ExplainRequest, progress: &dyn Progress) -> Result<Explanation> {
    let survey = Survey::read(&request.survey)?;
    let frame = find_frame(&survey, &request.frame)?;
    let ([col, row], width, height) = (request.pixel, survey.camera.width, survey.camera.height);
    if col >= width || row >= height {
        return Err(Error::Explain(format!(
            "pixel {col},{row} is outside the image: columns run from 0 to {}, rows from 0 to {}",
            width.saturating_sub(1),
            height.saturating_sub(1)
        )));
    }
    let (calibration, words) = read_calibration(&root_of(&request.survey), request.calibration.as_deref())?;
    let plan = match &request.plan {
        Some(plan) => plan.clone(),
        None => all_stages(survey.level, calibration.as_ref()),
    };
    let station = survey.frames[frame].station.clone();
    let opened = open(&request.survey, (calibration, words), Purpose::of(&plan.stages))?;
    plan.check_level(survey.level)?;
    let mut line = Line::new(&plan.stages, &opened)?;
    let mut explanation = Explanation {
        frame,
        file: survey.frames[frame].file.display().to_string(),
        station: station.clone(),
        pixel: request.pixel,
        calibration: opened.calibration_words.clone(),
        raw_range_m: None,
        stages: Vec::new(),
        range_m: None,
        sigma_m: None,
        amplitude: None,
        moved_m: 0.0,
        whole_intervals_m: 0.0,
        point_m: None,
        flags: Vec::new(),
    };
    let mut follower = Follower {
        explanation: &mut explanation,
        before: None,
        state: None,
        is_range: false,
        flags: FlagWatch::default(),
    };
    follow_station(&opened, &station, (&plan.stages, &mut line), &mut follower, progress)?;
    follower.finish(line.rays());
    progress.finish();
    Ok(explanation)
}

/// Writes down what the stages do to the view that the frame is in.
struct Follower<'a> {
    explanation: &'a mut Explanation,
    before: Option<View>,
    state: Option<PixelState>,
    /// Whether the view has come to ranges.
    is_range: bool,
    flags: FlagWatch,
}

impl Watch for Follower<'_> {
    fn before(&mut self, _: usize, _: &Stage, views: &[View]) {
        let Some(view) = views.iter().find(|view| view.frames.contains(&self.explanation.frame)) else { return };
        if self.state.is_none() {
            let state = state_of(view, self.explanation.pixel);
            self.explanation.raw_range_m = state.range_m;
            self.flags.start(state.flags);
            self.state = Some(state);
        }
        self.before = Some(view.clone());
    }

    fn after(&mut self, _: usize, stage: &Stage, views: &[View]) {
        let explanation = &mut *self.explanation;
        let found = views.iter().find(|view| view.frames.contains(&explanation.frame));
        let (Some(after), Some(before), Some(state)) = (found, self.before.take(), self.state) else { return };
        let next = state_of(after, explanation.pixel);
        if explanation.raw_range_m.is_none() {
            explanation.raw_range_m = next.range_m;
        }
        let change_m = state.range_m.zip(next.range_m).map(|(from, to)| to - from);
        let parts =
            change_m.map_or_else(Vec::new, |change| parts::parts(stage, &before, after, explanation.pixel, change));
        let (range_m, sigma_m) = (next.range_m, next.sigma_m);
        explanation.stages.push(StageLine { stage: stage.name(), change_m, parts, range_m, sigma_m });
        self.flags.after(stage, after, explanation.pixel, &state, &next);
        self.is_range = matches!(after.data, ViewData::Range(_));
        self.state = Some(next);
    }
}

impl Follower<'_> {
    fn finish(self, rays: &RayTable) {
        let (explanation, Some(state)) = (self.explanation, self.state) else { return };
        let whole = |part: &&StagePart| part.group == WHOLE_INTERVALS;
        let parts = || explanation.stages.iter().flat_map(|line| &line.parts);
        let whole_intervals_m = parts().filter(whole).map(|part| part.change_m).sum();
        let all: f64 = explanation.stages.iter().filter_map(|line| line.change_m).sum();
        (explanation.whole_intervals_m, explanation.moved_m) = (whole_intervals_m, all - whole_intervals_m);
        (explanation.range_m, explanation.sigma_m, explanation.amplitude) =
            (state.range_m, state.sigma_m, state.amplitude);
        let [col, row] = explanation.pixel;
        let range_m = state.range_m.filter(|_| self.is_range);
        explanation.point_m = range_m.map(|range| (range * rays.direction(col, row)).into());
        explanation.flags = self.flags.reasons(state.flags);
    }
}

/// The frame by its number or file.
fn find_frame(survey: &Survey, name: &str) -> Result<usize> {
    let by_number = name.parse::<usize>().ok().filter(|number| *number < survey.frames.len());
    let by_file = survey
        .frames
        .iter()
        .position(|frame| frame.file.as_os_str() == name || frame.file.file_name().is_some_and(|file| file == name));
    by_number.or(by_file).ok_or_else(|| {
        /// So many frames are named; more would push the message off the screen.
        const NAMED: usize = 20;
        let named = survey.frames.iter().enumerate().take(NAMED);
        let named: Vec<String> =
            named.map(|(k, frame)| format!("{k}: {} ({})", frame.file.display(), frame.station)).collect();
        let more = survey.frames.len().saturating_sub(NAMED);
        let more = if more > 0 { format!(", and {more} more") } else { String::new() };
        Error::Explain(format!("there is no frame `{name}`; the survey has {}{more}", named.join(", ")))
    })
}

/// All stages that level and calibration leave room for.
fn all_stages(level: Level, calibration: Option<&Calibration>) -> Plan {
    let scattering = calibration.is_some_and(|calibration| calibration.scattering.is_some());
    let models = calibration.is_some_and(pipeline::stages::corrects_ranges);
    let mut stages = vec![
        Stage::Demodulate(pipeline::DemodulateOptions::default()),
        Stage::Average(pipeline::AverageOptions::default()),
    ];
    if scattering {
        stages.push(Stage::Deconvolve(pipeline::DeconvolveOptions::default()));
    }
    stages.push(Stage::Unwrap(pipeline::UnwrapOptions::default()));
    if models {
        stages.push(Stage::CorrectRange(pipeline::CorrectRangeOptions::default()));
    }
    if calibration.is_some() {
        stages.push(Stage::CorrectImagePoint(pipeline::CorrectImagePointOptions::default()));
    }
    stages.push(Stage::Multipath(pipeline::MultipathOptions::default()));
    stages.push(Stage::FuseExposures(pipeline::FuseExposuresOptions::default()));
    stages.push(Stage::PointCloud(pipeline::PointCloudOptions::default()));
    stages.push(Stage::Flag(pipeline::FlagOptions::default()));
    stages.retain(|stage| !is_past(level, stage.needs()));
    Plan { name: "explain".to_owned(), source: None, calibrate: None, stages }
}

/// The pixel as far as it is known.
fn state_of(view: &View, [col, row]: [usize; 2]) -> PixelState {
    let at = (col, row);
    let known = |value: f32| Some(f64::from(value)).filter(|value| value.is_finite());
    let flags = view.flags().map_or(Flags::empty(), |flags| flags[at]);
    let nothing = PixelState { range_m: None, sigma_m: None, amplitude: None, amplitude_sigma: None, flags };
    match &view.data {
        ViewData::Samples(_) => nothing,
        ViewData::Phase(frame) => {
            let (Some(channel), Some(snapshot)) = (frame.channels.first(), view.snapshot()) else { return nothing };
            PixelState {
                range_m: known(snapshot.range[at]),
                sigma_m: known(channel.sigma_range()[at]),
                amplitude: known(snapshot.amplitude[at]),
                amplitude_sigma: known(channel.sigma[at]),
                flags,
            }
        }
        ViewData::Range(frame) => {
            let (sigma_m, amplitude) = (known(frame.sigma[at]), known(frame.amplitude[at]));
            // sigma_range = U / 2 pi * sigma_amplitude / amplitude, of the first frequency.
            let first = view.channels.first().map_or(sigma_m, |channel| known(channel.sigma[at]));
            let radians = view.modulation.map(|modulation| modulation.phase_from_range(1.0));
            let parts = first.zip(amplitude).zip(radians);
            let amplitude_sigma = parts.map(|((sigma, amplitude), per_metre)| sigma * amplitude * per_metre);
            // The point stands where the pixel's width has been taken off, in single precision where it has not moved.
            let point = view.cloud.as_ref().map(|cloud| Vector3::from(cloud.points[row * cloud.width + col]));
            let range_m = known(point.map_or(frame.range[at], |point| point.norm() as f32));
            PixelState { range_m, sigma_m, amplitude, amplitude_sigma, flags }
        }
    }
}
