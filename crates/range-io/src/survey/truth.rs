use std::path::Path;

use range_image::Raster;

use super::Survey;
use super::arrays::{ArrayFile, Expected, REAL, raster};
use crate::formats::npz::{DataType, NpzReader, NpzWriter, Values};
use crate::{Error, Result};

/// The truth of one simulated frame.
#[derive(Debug, Clone, PartialEq)]
pub struct TruthFrame {
    /// Range along the ray of each pixel's centre in metres, NaN where it meets nothing.
    pub range: Raster<f32>,
    /// Whole ambiguity intervals in the range; one plane for each modulation frequency.
    pub wraps: Vec<Raster<i32>>,
    /// Whether a pixel's footprint covers several distances.
    pub mixed: Raster<bool>,
}

/// Reads the truth of frame `index` (from 0), `None` where the survey has none.
///
/// Arrays: `range[H, W]` f32, `wraps[F, H, W]` or `[H, W]` i32, `mixed[H, W]` bool. A frame whose truth is nowhere finite
/// is allowed: it looks into nothing.
pub fn read_truth(survey: &Survey, root: &Path, index: usize) -> Result<Option<TruthFrame>> {
    let Some(entry) = survey.truth.as_ref().and_then(|truth| truth.frames.get(index)) else { return Ok(None) };
    let file = root.join(entry);
    let size = [survey.camera.width, survey.camera.height];
    let mut arrays = ArrayFile::Npz(NpzReader::open(&file)?);
    let shape = &[size[1], size[0]];
    let range = arrays.array(&file, &Expected { name: "range", types: REAL, axes: "H W", shape })?.values.into_f32();
    let expected = Expected { name: "mixed", types: &[DataType::Bool, DataType::U8], axes: "H W", shape };
    let mixed = match arrays.array(&file, &expected)?.values {
        Values::Bool(values) => values,
        other => other.into_f32().iter().map(|&value| value > 0.0).collect(),
    };
    Ok(Some(TruthFrame {
        range: raster(&file, "range", size, range)?,
        wraps: read_wraps(survey, &file, &mut arrays)?,
        mixed: raster(&file, "mixed", size, mixed)?,
    }))
}

fn read_wraps<R: std::io::Read + std::io::Seek>(
    survey: &Survey,
    file: &Path,
    arrays: &mut ArrayFile<R>,
) -> Result<Vec<Raster<i32>>> {
    const TYPES: &[DataType] = &[DataType::I32];
    let (width, height) = (survey.camera.width, survey.camera.height);
    let planes = survey.camera.modulation_hz.len().max(1);
    let of_all = Expected { name: "wraps", types: TYPES, axes: "F H W", shape: &[planes, height, width] };
    let of_one = Expected { name: "wraps", types: TYPES, axes: "H W", shape: &[height, width] };
    let array = match arrays.array(file, &of_all) {
        Err(Error::ArrayShape { .. }) if planes == 1 => arrays.array(file, &of_one)?,
        other => other?,
    };
    let Values::I32(values) = array.values else { return Ok(Vec::new()) };
    values.chunks_exact(width * height).map(|plane| raster(file, "wraps", [width, height], plane.to_vec())).collect()
}

/// Writes the truth of a frame as `.npz`, `wraps` as `[F, H, W]`.
pub fn write_truth(path: impl AsRef<Path>, truth: &TruthFrame) -> Result<()> {
    let mut writer = NpzWriter::create(path)?;
    let shape = [truth.wraps.len(), truth.range.height(), truth.range.width()];
    writer.add("range", &shape[1..], truth.range.as_slice())?;
    let wraps: Vec<i32> = truth.wraps.iter().flat_map(|plane| plane.as_slice().iter().copied()).collect();
    writer.add("wraps", &shape, &wraps)?;
    writer.add("mixed", &shape[1..], truth.mixed.as_slice())?;
    writer.commit()
}
