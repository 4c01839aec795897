//! What is known of the camera before its first frame.

use std::path::{Path, PathBuf};

use commands::{Error, Inputs, Result, root_of};
use live_frames::tracking::{SurfaceMap, TrackerOptions};
use live_frames::{Limits, LiveCamera, Processor, Stages, UnwrapStage};
use range_image::DemodulationOptions;
use range_io::calibration::Calibration;
use range_io::error_models::{ModelSet, WarmUp};
use range_io::survey::Survey;

use super::datum::Datum;
use super::request::LiveRequest;
use crate::sources::LiveSource;
use crate::streams::StreamTarget;
use crate::wire::FrameHeader;

/// A camera that is ready for its frames.
pub(super) struct Setup {
    pub(super) processor: Processor,
    pub(super) drift: Option<WarmUp>,
    pub(super) datum: Datum,
    /// What the camera is known by, in words.
    pub(super) survey: PathBuf,
    pub(super) calibration: Option<PathBuf>,
}

pub(super) fn request(message: impl Into<String>) -> Error {
    Error::Request { command: "live", message: message.into() }
}

impl Setup {
    pub(super) fn new(asked: &LiveRequest) -> Result<Self> {
        let survey_path = asked.survey.as_deref().or(asked.source.recording()).ok_or_else(|| {
            let words = match &asked.source {
                LiveSource::Path(path) if !path.exists() => "there is no such file or folder",
                _ => "does not say which camera its frames are of: name a folder with its survey.ron by --survey",
            };
            request(format!("{}: {words}", asked.source))
        })?;
        let survey = Survey::read(survey_path)?;
        let beside = Some(root_of(survey_path).join(Calibration::FILE_NAME)).filter(|file| file.is_file());
        let file = asked.calibration.clone().or(beside);
        let calibration = match &file {
            Some(file) => Calibration::read(file)?,
            None => {
                Calibration::from_models(&survey.camera.nominal_camera()?, &ModelSet { entries: Vec::new() }, None)?
            }
        };
        for target in asked.targets().iter().filter_map(StreamTarget::file) {
            check_target(asked, target, survey_path, file.as_deref())?;
        }
        let camera = live_camera(asked, &survey)?;
        let unwrap = UnwrapStage { maximum_range_m: asked.maximum_range_m, ..UnwrapStage::default() };
        let tracking = asked.tracking.as_ref().map(|_| TrackerOptions::default());
        let stages = Stages { drift: asked.drift, unwrap, tracking, ..Stages::default() };
        let mut processor = Processor::new(&camera, &calibration, stages, Limits::default())
            .map_err(|error| request(error.to_string()))?;
        if let Some(tracking) = asked.tracking.as_ref().filter(|tracking| tracking.map.is_some()) {
            processor.keep_map(SurfaceMap::new(tracking.map_options).map_err(|error| request(error.to_string()))?);
        }
        Ok(Self {
            datum: Datum::read(asked)?,
            processor,
            drift: calibration.warm_up.map(|drift| drift.model),
            survey: survey_path.to_owned(),
            calibration: file,
        })
    }
}

fn live_camera(asked: &LiveRequest, survey: &Survey) -> Result<LiveCamera> {
    let camera = &survey.camera;
    let phase_steps = camera.phase_steps.ok_or_else(|| request("`camera.phase_steps` of survey.ron is missing"))?;
    Ok(LiveCamera {
        width: camera.width,
        height: camera.height,
        phase_steps,
        modulations: camera.modulations()?,
        demodulation: DemodulationOptions {
            low_amplitude: asked.low_amplitude,
            phase_sense: camera.phase_sense,
            phase_offset_rad: camera.phase_offset_rad,
            raw_scale: camera.raw_scale,
            saturation: camera.saturation,
            ..DemodulationOptions::default()
        },
        power_on_s: asked.power_on_s.or(survey.power_on_s),
    })
}

/// Refuses a file of results that is, or lies in, something that is read.
fn check_target(asked: &LiveRequest, file: &Path, survey: &Path, calibration: Option<&Path>) -> Result<()> {
    let mut read: Vec<PathBuf> = calibration.map(Path::to_owned).into_iter().collect();
    read.push(root_of(survey));
    if let LiveSource::Path(path) | LiveSource::Unix(path) = &asked.source {
        read.push(if asked.source.recording().is_some() { root_of(path) } else { path.clone() });
    }
    // A link leads to what it would be written over.
    let place = |path: &Path| std::fs::canonicalize(path);
    let parent = file.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let beside = place(parent).map(|parent| parent.join(file.file_name().unwrap_or_default()));
    let places = [place(file), beside].into_iter().flatten();
    for place_of_file in places {
        if let Some(input) = read.iter().find(|input| place(input).is_ok_and(|input| place_of_file.starts_with(input)))
        {
            let words = "cannot be the output file: it is, or lies in,";
            return Err(request(format!(
                "{} {words} {}, which is read; name another one",
                file.display(),
                input.display()
            )));
        }
    }
    // A survey may name frames outside of its folder.
    let inputs = Inputs::default().survey(survey).maybe(asked.source.recording());
    if file.exists() { Ok(()) } else { inputs.destination(file).map(drop) }
}

/// How a frame does not fit the camera.
pub(super) fn misfit(header: &FrameHeader, camera: &LiveCamera) -> Option<String> {
    let words = |[width, height, frequencies, steps]: [usize; 4]| {
        format!("{width} x {height} pixels, {frequencies} frequencies of {steps} phase steps")
    };
    let found = [header.width, header.height, header.frequencies, header.phase_steps];
    let expected = [camera.width, camera.height, camera.modulations.len(), camera.phase_steps];
    (found != expected).then(|| format!("a frame of {}, the camera has {}", words(found), words(expected)))
}
