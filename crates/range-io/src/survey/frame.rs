//! Frames in and out of files.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use range_image::{ComplexFrame, PhaseConvention, Raster, RawFrame, Samples};

use super::arrays::{ArrayFile, COUNT, Expected, REAL, array_error, raster, require_finite};
use super::{Level, StoredDepth, Survey, SurveyCamera};
use crate::npz::{DataType, NpzReader, NpzWriter, Values};
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
}

impl InputFrame {
    /// Level of the frame.
    pub fn level(&self) -> Level {
        match self {
            Self::Samples(_) => Level::Samples,
            Self::Phase(_) => Level::Phase,
            Self::Range { .. } => Level::Range,
            Self::Depth { .. } => Level::Depth,
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
        Some("png") => read_png(survey, &file),
        Some("mkv") => read_mkv(survey, &file, number),
        _ => Err(Error::format(&file, "is of no known kind of frame; read are .npz, .npy, .png and .mkv")),
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
    }
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

fn read_depth<R: std::io::Read + std::io::Seek>(
    survey: &Survey,
    file: &Path,
    arrays: &mut ArrayFile<R>,
) -> Result<Raster<f32>> {
    let size = [survey.camera.width, survey.camera.height];
    // Integers have no unit of their own: they need the survey's word for it.
    let types: &[DataType] = if survey.depth.is_some() { &[DataType::F32, DataType::F64, DataType::U16] } else { REAL };
    let expected = Expected { name: "depth", types, axes: "H W", shape: &[size[1], size[0]] };
    let values = arrays.array(file, &expected)?.values;
    match (values, &survey.depth) {
        (Values::U16(stored), Some(scale)) => depth_from_stored(file, scale, &raster(file, "depth", size, stored)?),
        (values, _) => {
            require_finite(file, "depth", &values)?;
            raster(file, "depth", size, values.into_f32())
        }
    }
}

/// Stored integers in metres, NaN where they say invalid; at least one must be valid.
fn depth_from_stored(file: &Path, scale: &StoredDepth, stored: &Raster<u16>) -> Result<Raster<f32>> {
    let depth =
        stored.map(
            |&value| {
                if scale.invalid.contains(&value) { f32::NAN } else { (f64::from(value) * scale.scale_m) as f32 }
            },
        );
    if depth.as_slice().iter().all(|value| value.is_nan()) {
        return Err(array_error(file, "depth", format!("holds only values that mean no depth: {:?}", scale.invalid)));
    }
    Ok(depth)
}

#[cfg(any(feature = "png16", feature = "mkv"))]
fn stored_depth<'a>(survey: &'a Survey, file: &Path) -> Result<&'a StoredDepth> {
    if survey.level != Level::Depth {
        let level = survey.level.name();
        return Err(Error::format(file, format!("holds depths, but the survey's level is `{level}`")));
    }
    survey.depth.as_ref().ok_or_else(|| {
        Error::format(file, "holds integers; survey.ron must say `depth: (scale_m: .., invalid: ..)` to read them")
    })
}

#[cfg(any(feature = "png16", feature = "mkv"))]
fn require_size<T>(survey: &Survey, file: &Path, image: &Raster<T>) -> Result<()> {
    let (width, height) = (survey.camera.width, survey.camera.height);
    if (image.width(), image.height()) == (width, height) {
        return Ok(());
    }
    let found = format!("has {} x {} pixels, expected {width} x {height}", image.width(), image.height());
    Err(Error::format(file, found))
}

#[cfg(feature = "png16")]
fn read_png(survey: &Survey, file: &Path) -> Result<InputFrame> {
    let scale = stored_depth(survey, file)?;
    let stored = crate::png16::read(file)?;
    require_size(survey, file, &stored)?;
    Ok(InputFrame::Depth { depth: depth_from_stored(file, scale, &stored)?, amplitude: None, confidence: None })
}

#[cfg(not(feature = "png16"))]
fn read_png(_: &Survey, file: &Path) -> Result<InputFrame> {
    Err(Error::format(file, "needs the feature `png16`, which this build leaves out"))
}

#[cfg(feature = "mkv")]
fn read_mkv(survey: &Survey, file: &Path, number: usize) -> Result<InputFrame> {
    let scale = stored_depth(survey, file)?;
    let frame = crate::mkv::read_frame(file, number)?;
    require_size(survey, file, &frame.depth)?;
    let amplitude = frame.infrared.map(|image| image.map(|&value| f32::from(value)));
    if let Some(amplitude) = &amplitude {
        require_size(survey, file, amplitude)?;
    }
    Ok(InputFrame::Depth { depth: depth_from_stored(file, scale, &frame.depth)?, amplitude, confidence: None })
}

#[cfg(not(feature = "mkv"))]
fn read_mkv(_: &Survey, file: &Path, _: usize) -> Result<InputFrame> {
    Err(Error::format(file, "needs the feature `mkv`, which this build leaves out"))
}

/// Writes a frame as the `.npz` of its level.
///
/// Of a frame of level `phase` the phase goes out in the conventions' sense, so the survey must not give another.
pub fn write_frame(path: impl AsRef<Path>, frame: &InputFrame) -> Result<()> {
    let mut writer = NpzWriter::create(path)?;
    match frame {
        InputFrame::Samples(frame) => {
            let shape = [frame.modulations().len(), frame.phase_steps(), frame.height(), frame.width()];
            match frame.samples() {
                Samples::F32(values) => writer.add("samples", &shape, values)?,
                Samples::U16(values) => writer.add("samples", &shape, values)?,
                Samples::I16(values) => writer.add("samples", &shape, values)?,
            }
        }
        InputFrame::Phase(frame) => write_phase(&mut writer, frame)?,
        InputFrame::Range { range, amplitude, confidence } => {
            write_planes(
                &mut writer,
                [("range", Some(range)), ("amplitude", amplitude.as_ref()), ("confidence", confidence.as_ref())],
            )?;
        }
        InputFrame::Depth { depth, amplitude, confidence } => {
            write_planes(
                &mut writer,
                [("depth", Some(depth)), ("amplitude", amplitude.as_ref()), ("confidence", confidence.as_ref())],
            )?;
        }
    }
    writer.commit()
}

fn write_phase(writer: &mut NpzWriter<crate::atomic::FileWriter>, frame: &ComplexFrame) -> Result<()> {
    let shape = [frame.channels.len(), frame.height(), frame.width()];
    let collect = |plane: &dyn Fn(&range_image::ComplexChannel) -> Raster<f32>| {
        frame.channels.iter().flat_map(|channel| plane(channel).into_vec()).collect::<Vec<_>>()
    };
    writer.add("phase", &shape, &collect(&range_image::ComplexChannel::phase))?;
    writer.add("amplitude", &shape, &collect(&range_image::ComplexChannel::amplitude))?;
    let intensity = frame.channels.first().and_then(|channel| channel.offset.as_ref());
    intensity.map_or(Ok(()), |plane| writer.add("intensity", &shape[1..], plane.as_slice()))
}

fn write_planes(
    writer: &mut NpzWriter<crate::atomic::FileWriter>,
    planes: [(&str, Option<&Raster<f32>>); 3],
) -> Result<()> {
    for (name, plane) in planes {
        if let Some(plane) = plane {
            writer.add(name, &[plane.height(), plane.width()], plane.as_slice())?;
        }
    }
    Ok(())
}
