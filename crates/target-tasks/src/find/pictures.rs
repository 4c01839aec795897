//! What targets are looked for in: the light of each station, with its ranges where there are any.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use camera_model::Camera;
use commands::plan::to_ranges;
use commands::{Silent, root_of};
use pipeline::run::process_each;
use pipeline::survey::{OpenSurvey, View, ViewData, read_calibration};
use pipeline::{Error, Plan, Result};
use range_image::{RangeFrame, Raster};
use range_io::grey;
use range_io::survey::{FrameEntry, InputFrame, Level, Survey, SurveyCamera, read_frame};
use targets::principal_distance_px;

use crate::find::request::TargetsRequest;
use crate::find::station::Pair;

/// One station's light, as a mean over its frames.
pub(crate) struct Picture {
    pub(crate) station: String,
    pub(crate) light: Raster<f32>,
    /// Unwrapped and uncorrected.
    pub(crate) ranges: Option<(RangeFrame, Camera)>,
    /// Whether scattered light was taken off.
    pub(crate) is_restored: bool,
    pub(crate) integration_time_s: Option<f64>,
}

/// All stations, read one after the other.
pub(crate) struct Pictures {
    /// The survey, or what a folder of images stands for; then its principal distance is not known yet.
    pub(crate) survey: Survey,
    pub(crate) root: PathBuf,
    /// Calibration in use, and what to call it.
    calibration: Option<PathBuf>,
    pub(crate) is_folder: bool,
}

/// Any will do for a camera of which nothing but images is known: nothing depends on the size of its pixels.
const PITCH_MM: f64 = 0.01;

impl Pictures {
    pub(crate) fn open(request: &TargetsRequest) -> Result<Self> {
        let root = root_of(&request.survey);
        let calibration = request.calibration.clone();
        if let Some(survey) = images(&request.survey)? {
            return Ok(Self { survey, root, calibration, is_folder: true });
        }
        let survey = Survey::read(&request.survey)?;
        if survey.frames.is_empty() {
            let path = request.survey.join(Survey::FILE_NAME);
            return Err(Error::Survey { path, message: "it lists no frames to look for targets in".to_owned() });
        }
        if let Some(given) = request.principal_distance_px {
            let message = format!(
                "--principal-distance {given} is for folders of images; survey.ron states {} mm",
                survey.camera.principal_distance_mm
            );
            return Err(Error::Request { command: "targets", message });
        }
        Ok(Self { survey, root, calibration, is_folder: false })
    }

    /// Names of stations in the order of the survey.
    fn names(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for frame in &self.survey.frames {
            if !names.contains(&frame.station.as_str()) {
                names.push(&frame.station);
            }
        }
        names
    }

    pub(crate) fn stations(&self) -> usize {
        self.names().len()
    }

    /// Whether there are ranges beside the light.
    pub(crate) fn has_ranges(&self) -> bool {
        self.survey.level != Level::Intensity
    }

    /// Hands on the picture of each station.
    pub(crate) fn each(&self, take: &mut dyn FnMut(Picture) -> Result<()>) -> Result<()> {
        if self.has_ranges() { self.each_view(take) } else { self.each_image(take) }
    }

    fn each_view(&self, take: &mut dyn FnMut(Picture) -> Result<()>) -> Result<()> {
        let known = read_calibration(&self.root, self.calibration.as_deref())?;
        let restores = known.0.as_ref().is_some_and(|calibration| calibration.scattering.is_some());
        let stages = to_ranges(self.survey.level, restores);
        let plan = Plan { name: "targets".to_owned(), source: None, calibrate: None, stages };
        let mut keep = |view: View, survey: &OpenSurvey| {
            let ViewData::Range(frame) = &view.data else {
                return Err(Error::Needs { stage: "targets", needs: "Unwrap" });
            };
            let light = frame.amplitude.clone();
            if light.as_slice().iter().all(|value| value.is_nan()) {
                let name = view.name();
                return Err(Error::unfit(
                    "targets",
                    &name,
                    "its frames have no amplitudes, and targets are seen by light",
                ));
            }
            let (station, integration_time_s) = (view.station.clone(), view.integration_time_s);
            let ranges = Some((frame.clone(), survey.best_camera()));
            take(Picture { station, light, ranges, is_restored: restores, integration_time_s })
        };
        // The path names the folder or its survey.ron: the stages read either.
        process_each(&plan, &self.root, known, &mut keep, &Silent)?;
        Ok(())
    }

    fn each_image(&self, take: &mut dyn FnMut(Picture) -> Result<()>) -> Result<()> {
        let mut frames: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
        for (index, frame) in self.survey.frames.iter().enumerate() {
            frames.entry(&frame.station).or_default().push(index);
        }
        for station in self.names() {
            let indices = &frames[station];
            let mut light: Option<Raster<f32>> = None;
            for &index in indices {
                let InputFrame::Intensity(image) = read_frame(&self.survey, &self.root, index)? else {
                    return Err(Error::Camera("frames at level `intensity` hold images".to_owned()));
                };
                match &mut light {
                    None => light = Some(image),
                    Some(sum) => {
                        let sums = sum.as_mut_slice().iter_mut();
                        sums.zip(image.as_slice()).for_each(|(sum, value)| *sum += value);
                    }
                }
            }
            let Some(sum) = light else { continue };
            let light = sum.map(|value| value / indices.len() as f32);
            let integration_time_s = self.survey.frames[indices[0]].integration_time_s;
            take(Picture { station: station.to_owned(), light, ranges: None, is_restored: false, integration_time_s })?;
        }
        Ok(())
    }

    /// The survey's camera; of a folder of images with a principal distance that was given or that the boards tell.
    pub(crate) fn camera(&self, request: &TargetsRequest, boards: &[Vec<Pair>]) -> Result<SurveyCamera> {
        let mut camera = self.survey.camera.clone();
        if !self.is_folder {
            return Ok(camera);
        }
        let told = request.principal_distance_px.or_else(|| principal_distance_px(&camera.format().ok()?, boards));
        // Without any board nothing is written: any number will do.
        let told = if boards.is_empty() { told.or(Some(1.0)) } else { told };
        let distance_px = told.ok_or_else(|| Error::Request {
            command: "targets",
            message:
                "the boards do not tell the camera's principal distance, as they are seen without perspective: tilt \
                      some of them by 30 degrees and more, or give it with --principal-distance PIXELS"
                    .to_owned(),
        })?;
        camera.principal_distance_mm = PITCH_MM * distance_px;
        Ok(camera)
    }
}

/// The survey that a folder of images without `survey.ron` stands for; `None` where it is something else.
fn images(folder: &Path) -> Result<Option<Survey>> {
    if !folder.is_dir() || folder.join(Survey::FILE_NAME).exists() {
        return Ok(None);
    }
    let failed = |source| Error::Access { path: folder.to_owned(), source };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let name = PathBuf::from(entry.map_err(failed)?.file_name());
        let ending = name.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        let is_image = ending.is_some_and(|ending| ["png", "jpg", "jpeg"].contains(&ending.as_str()));
        // Depth images of other kinds of folders are no light.
        if is_image && !name.to_string_lossy().contains(".depth.") {
            files.push(name);
        }
    }
    files.sort_by_key(|file| natural_order(&file.to_string_lossy()));
    let Some(first) = files.first() else { return Ok(None) };
    let image = grey::read(folder.join(first))?;
    let camera = SurveyCamera {
        width: image.width(),
        height: image.height(),
        pixel_pitch_mm: [PITCH_MM; 2],
        principal_distance_mm: PITCH_MM * image.width() as f64,
        principal_point_mm: [0.0, 0.0],
        modulation_hz: Vec::new(),
        phase_steps: None,
        phase_sense: range_io::survey::PhaseSense::Positive,
        phase_offset_rad: 0.0,
        saturation: None,
        raw_scale: 1.0,
    };
    let entry = |file: &PathBuf| FrameEntry {
        file: file.clone(),
        station: file.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        timestamp_s: None,
        integration_time_s: None,
        temperature_c: None,
    };
    Ok(Some(Survey::new(camera, Level::Intensity, files.iter().map(entry).collect())))
}

/// Numbers in a name count as numbers: `2.png` before `10.png`.
fn natural_order(name: &str) -> Vec<(String, u64)> {
    let mut parts = Vec::new();
    let mut rest = name;
    while !rest.is_empty() {
        let words = rest.find(|c: char| c.is_ascii_digit()).unwrap_or(rest.len());
        let (text, tail) = rest.split_at(words);
        let digits = tail.find(|c: char| !c.is_ascii_digit()).unwrap_or(tail.len());
        let (number, tail) = tail.split_at(digits);
        parts.push((text.to_owned(), number.parse().unwrap_or(0)));
        rest = tail;
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_ordered_by_their_numbers() {
        let mut names = ["10.png", "2.png", "a2b11.png", "a2b9.png", "1.png"];
        names.sort_by_key(|name| natural_order(name));
        assert_eq!(names, ["1.png", "2.png", "10.png", "a2b9.png", "a2b11.png"]);
    }
}
