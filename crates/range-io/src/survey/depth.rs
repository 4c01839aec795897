//! Depths, which files store in metres or as integers.

use std::path::Path;

use range_image::Raster;

#[cfg(any(feature = "png16", feature = "mkv"))]
use super::Level;
use super::arrays::{ArrayFile, Expected, REAL, nothing_measured, raster, require_finite};
use super::{InputFrame, StoredDepth, Survey};
use crate::formats::npz::{DataType, Values};
use crate::{Error, Result};

pub(super) fn read_depth<R: std::io::Read + std::io::Seek>(
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
        let reason = format!("holds only values that mean no depth: {:?}", scale.invalid);
        return Err(nothing_measured(file, "depth", reason));
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

#[cfg(any(feature = "grey", feature = "png16", feature = "mkv"))]
pub(super) fn require_size<T>(survey: &Survey, file: &Path, image: &Raster<T>) -> Result<()> {
    let (width, height) = (survey.camera.width, survey.camera.height);
    if (image.width(), image.height()) == (width, height) {
        return Ok(());
    }
    let found = format!("has {} x {} pixels, expected {width} x {height}", image.width(), image.height());
    Err(Error::format(file, found))
}

#[cfg(feature = "png16")]
pub(super) fn read_png(survey: &Survey, file: &Path) -> Result<InputFrame> {
    let scale = stored_depth(survey, file)?;
    let stored = crate::formats::images::png16::read(file)?;
    require_size(survey, file, &stored)?;
    Ok(InputFrame::Depth { depth: depth_from_stored(file, scale, &stored)?, amplitude: None, confidence: None })
}

#[cfg(not(feature = "png16"))]
pub(super) fn read_png(_: &Survey, file: &Path) -> Result<InputFrame> {
    Err(Error::format(file, "needs the feature `png16`, which this build leaves out"))
}

#[cfg(feature = "mkv")]
pub(super) fn read_mkv(survey: &Survey, file: &Path, number: usize) -> Result<InputFrame> {
    let scale = stored_depth(survey, file)?;
    let frame = crate::formats::mkv::read_frame(file, number)?;
    require_size(survey, file, &frame.depth)?;
    let amplitude = frame.infrared.map(|image| image.map(|&value| f32::from(value)));
    if let Some(amplitude) = &amplitude {
        require_size(survey, file, amplitude)?;
    }
    Ok(InputFrame::Depth { depth: depth_from_stored(file, scale, &frame.depth)?, amplitude, confidence: None })
}

#[cfg(not(feature = "mkv"))]
pub(super) fn read_mkv(_: &Survey, file: &Path, _: usize) -> Result<InputFrame> {
    Err(Error::format(file, "needs the feature `mkv`, which this build leaves out"))
}
