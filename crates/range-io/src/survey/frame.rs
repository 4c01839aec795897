//! Frames out of files.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use range_image::{ComplexFrame, PhaseConvention, Raster, RawFrame, Samples};

use super::arrays::{ArrayFile, COUNT, Expected, REAL, array_error, raster, require_finite};
#[cfg(feature = "grey")]
use super::depth::require_size;
use super::depth::{read_depth, read_mkv, read_png};
use super::{Level, Survey, SurveyCamera};
use crate::formats::npz::{DataType, NpzReader, Values};
use crate::{Error, Result};

/// One frame as a survey's file holds it, checked against the survey.
///
/// Pixels that are not finite are data: they are kept here and flagged by the stages. All planes have the survey's size.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum InputFrame {
    /// Level `samples`.
    Samples(RawFrame),
    /// Level `phase`, the camera's sense and offset of the phase applied; a file's `intensity` is the channels' offset.
    Phase(ComplexFrame),
    /// Level `range`.
    Range {
        /// Radial range in metres.
        range: Raster<f32>,
        /// Amplitude in the camera's unit.
        amplitude: Option<Raster<f32>>,
        /// Confidence in the camera's unit.
        confidence: Option<Raster<f32>>,
    },
    /// Level `depth`; it becomes a range through the camera's rays, which are not known here.
    Depth {
        /// Depth along the viewing axis in metres; NaN where the file says invalid.
        depth: Raster<f32>,
        /// Amplitude in the camera's unit.
        amplitude: Option<Raster<f32>>,
        /// Confidence in the camera's unit.
        confidence: Option<Raster<f32>>,
    },
    /// Level `intensity`, in the camera's unit.
    Intensity(Raster<f32>),
}

impl InputFrame {
    /// Level of the frame.
    pub fn level(&self) -> Level {
        match self {
            Self::Samples(_) => Level::Samples,
            Self::Phase(_) => Level::Phase,
            Self::Range { .. } => Level::Range,
            Self::Depth { .. } => Level::Depth,
            Self::Intensity(_) => Level::Intensity,
        }
    }
}

/// Reads frame `index` (from 0) of a survey whose folder is `root`.
///
/// Names, types and shapes of the arrays must be those that the survey's level and camera ask for; arrays that the level
/// does not know are left alone.
pub fn read_frame(survey: &Survey, root: &Path, index: usize) -> Result<InputFrame> {
    let entry = survey.frames.get(index).ok_or_else(|| Error::Value {
        what: "survey",
        field: format!("frames[{index}]"),
        reason: format!("is asked for, but the survey has {} frames", survey.frames.len()),
    })?;
    let (file, number) = split_frame_number(&root.join(&entry.file));
    let extension = file.extension().map(|extension| extension.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        Some("npz") => read_arrays(survey, &file, &mut ArrayFile::Npz(NpzReader::open(&file)?)),
        Some("npy") => read_arrays(survey, &file, &mut ArrayFile::<BufReader<File>>::Npy),
        Some("png" | "jpg" | "jpeg") if survey.level == Level::Intensity => read_grey(survey, &file),
        Some("png") => read_png(survey, &file),
        Some("mkv") => read_mkv(survey, &file, number),
        _ => Err(Error::format(
            &file,
            "is of no known kind of frame; read are .npz, .npy, .png and .mkv, and of level `intensity` .jpg",
        )),
    }
}

/// `recording.mkv#3` is frame 3 of `recording.mkv`.
fn split_frame_number(path: &Path) -> (PathBuf, usize) {
    let split = path.to_str().and_then(|text| text.rsplit_once('#'));
    match split.and_then(|(file, number)| Some((file, number.parse().ok()?))) {
        Some((file, number)) => (PathBuf::from(file), number),
        None => (path.to_path_buf(), 0),
    }
}

fn read_arrays<R: std::io::Read + std::io::Seek>(
    survey: &Survey,
    file: &Path,
    arrays: &mut ArrayFile<R>,
) -> Result<InputFrame> {
    let camera = &survey.camera;
    let size = [camera.width, camera.height];
    match survey.level {
        Level::Samples => read_samples(camera, file, arrays),
        Level::Phase => read_phase(camera, file, arrays),
        Level::Range => Ok(InputFrame::Range {
            range: arrays.plane(file, "range", REAL, size)?,
            amplitude: arrays.optional_plane(file, "amplitude", COUNT, size)?,
            confidence: arrays.optional_plane(file, "confidence", COUNT, size)?,
        }),
        Level::Depth => Ok(InputFrame::Depth {
            depth: read_depth(survey, file, arrays)?,
            amplitude: arrays.optional_plane(file, "amplitude", COUNT, size)?,
            confidence: arrays.optional_plane(file, "confidence", COUNT, size)?,
        }),
        Level::Intensity => Ok(InputFrame::Intensity(arrays.plane(file, "intensity", COUNT, size)?)),
    }
}

#[cfg(feature = "grey")]
fn read_grey(survey: &Survey, file: &Path) -> Result<InputFrame> {
    let image = crate::grey::read(file)?;
    require_size(survey, file, &image)?;
    Ok(InputFrame::Intensity(image))
}

#[cfg(not(feature = "grey"))]
fn read_grey(_: &Survey, file: &Path) -> Result<InputFrame> {
    Err(Error::format(file, "needs the feature `grey`, which this build leaves out"))
}

fn read_samples<R: std::io::Read + std::io::Seek>(
    camera: &SurveyCamera,
    file: &Path,
    arrays: &mut ArrayFile<R>,
) -> Result<InputFrame> {
    const TYPES: &[DataType] = &[DataType::F32, DataType::U16, DataType::I16];
    let modulations = camera.modulations()?;
    let steps = camera.phase_steps.unwrap_or(0);
    let shape = &[modulations.len(), steps, camera.height, camera.width];
    let values = arrays.array(file, &Expected { name: "samples", types: TYPES, axes: "F N H W", shape })?.values;
    require_finite(file, "samples", &values)?;
    let samples = match values {
        Values::U16(values) => Samples::U16(values),
        Values::I16(values) => Samples::I16(values),
        other => Samples::F32(other.into_f32()),
    };
    let frame = RawFrame::new(camera.width, camera.height, steps, modulations, samples);
    frame.map(InputFrame::Samples).map_err(|error| array_error(file, "samples", error.to_string()))
}

fn read_phase<R: std::io::Read + std::io::Seek>(
    camera: &SurveyCamera,
    file: &Path,
    arrays: &mut ArrayFile<R>,
) -> Result<InputFrame> {
    if matches!(arrays, ArrayFile::Npy) {
        return Err(Error::format(file, "holds one array, level `phase` needs `phase` and `amplitude`: use .npz"));
    }
    let size = [camera.width, camera.height];
    let modulations = camera.modulations()?;
    let frequencies = modulations.len();
    let phase = read_planes(camera, frequencies, file, arrays, "phase")?;
    phase.iter().try_for_each(|plane| require_wrapped(file, plane))?;
    let amplitude = read_planes(camera, frequencies, file, arrays, "amplitude")?;
    let intensity = arrays.optional_plane(file, "intensity", COUNT, size)?;
    let convention = PhaseConvention { phase_sense: camera.phase_sense, phase_offset_rad: camera.phase_offset_rad };
    let mut frame = ComplexFrame::from_phase(modulations, phase, amplitude, &convention)
        .map_err(|error| array_error(file, "phase", error.to_string()))?;
    for channel in &mut frame.channels {
        channel.offset.clone_from(&intensity);
    }
    Ok(InputFrame::Phase(frame))
}

/// The planes of an array `[F, H, W]`.
fn read_planes<R: std::io::Read + std::io::Seek>(
    camera: &SurveyCamera,
    frequencies: usize,
    file: &Path,
    arrays: &mut ArrayFile<R>,
    name: &'static str,
) -> Result<Vec<Raster<f32>>> {
    let types = if name == "phase" { REAL } else { COUNT };
    let shape = &[frequencies, camera.height, camera.width];
    let values = arrays.array(file, &Expected { name, types, axes: "F H W", shape })?.values;
    require_finite(file, name, &values)?;
    let values = values.into_f32();
    let planes = values.chunks_exact(camera.width * camera.height);
    planes.map(|plane| raster(file, name, [camera.width, camera.height], plane.to_vec())).collect()
}

/// Phases from -pi to pi, or in degrees, would pass for others; they are refused.
fn require_wrapped(file: &Path, phase: &Raster<f32>) -> Result<()> {
    // A phase just below 2 pi may round up to it in single precision.
    let limit = std::f32::consts::TAU * (1.0 + f32::EPSILON);
    match phase.as_slice().iter().find(|value| value.is_finite() && !(0.0..=limit).contains(*value)) {
        None => Ok(()),
        Some(value) => Err(array_error(file, "phase", format!("has the value {value}, expected radian in [0, 2 pi)"))),
    }
}
