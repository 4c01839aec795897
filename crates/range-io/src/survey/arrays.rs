//! Arrays of frames: read where their names, shapes and types are what the survey says.

use std::io::{Read, Seek};
use std::path::Path;

use range_image::Raster;

use crate::formats::npz::{Array, ArrayHeader, DataType, NpzReader, Values, read_npy};
use crate::{Error, Result};

/// Any real type that stands for a measured quantity in its unit.
pub(super) const REAL: &[DataType] = &[DataType::F32, DataType::F64];
/// Types of amplitudes, intensities and confidences, which may be counts.
pub(super) const COUNT: &[DataType] =
    &[DataType::F32, DataType::F64, DataType::U8, DataType::U16, DataType::I16, DataType::I32];

/// The arrays of a file: an archive, or the single array of an `.npy`.
pub(super) enum ArrayFile<R> {
    Npz(NpzReader<R>),
    /// The array goes by the name that is asked for first.
    Npy,
}

/// What an array should be.
pub(super) struct Expected<'a> {
    pub name: &'static str,
    pub types: &'a [DataType],
    pub axes: &'static str,
    pub shape: &'a [usize],
}

impl Expected<'_> {
    fn accept(&self, file: &Path, header: &ArrayHeader) -> Result<()> {
        let (file, array) = (file.to_path_buf(), self.name.to_owned());
        if !self.types.contains(&header.data_type) {
            let types: Vec<_> = self.types.iter().map(|t| t.name()).collect();
            let (found, expected) = (header.data_type.name().to_owned(), types.join(", "));
            return Err(Error::ArrayType { file, array, found, expected });
        }
        if header.shape != self.shape {
            return Err(Error::ArrayShape { file, array, found: header.shape.clone(), expected: self.describe() });
        }
        Ok(())
    }

    /// Such as `[F, H, W] with F = 1, H = 144, W = 176`.
    fn describe(&self) -> String {
        let axes: Vec<_> = self.axes.split(' ').collect();
        let sizes: Vec<_> = axes.iter().zip(self.shape).map(|(axis, size)| format!("{axis} = {size}")).collect();
        format!("[{}] with {}", axes.join(", "), sizes.join(", "))
    }
}

impl<R: Read + Seek> ArrayFile<R> {
    pub fn array(&mut self, file: &Path, expected: &Expected) -> Result<Array> {
        let accept = |header: &ArrayHeader| expected.accept(file, header);
        match self {
            Self::Npz(archive) => archive.read(expected.name, accept),
            Self::Npy => read_npy(file, expected.name, accept),
        }
    }

    /// A plane `[H, W]` in single precision; at least one pixel must be finite.
    pub fn plane(
        &mut self,
        file: &Path,
        name: &'static str,
        types: &[DataType],
        size: [usize; 2],
    ) -> Result<Raster<f32>> {
        let [width, height] = size;
        let expected = Expected { name, types, axes: "H W", shape: &[height, width] };
        let values = self.array(file, &expected)?.values;
        require_finite(file, name, &values)?;
        raster(file, name, size, values.into_f32())
    }

    /// The same for an array that need not be there.
    pub fn optional_plane(
        &mut self,
        file: &Path,
        name: &'static str,
        types: &[DataType],
        size: [usize; 2],
    ) -> Result<Option<Raster<f32>>> {
        let there = match self {
            Self::Npz(archive) => archive.contains(name),
            Self::Npy => false,
        };
        if there { self.plane(file, name, types, size).map(Some) } else { Ok(None) }
    }
}

/// Refuses values of which none is finite: such a frame holds nothing.
pub(super) fn require_finite(file: &Path, name: &str, values: &Values) -> Result<()> {
    let any = match values {
        Values::F32(values) => values.iter().any(|value| value.is_finite()),
        Values::F64(values) => values.iter().any(|value| value.is_finite()),
        other => !other.is_empty(),
    };
    if any { Ok(()) } else { Err(nothing_measured(file, name, "has no finite value")) }
}

pub(super) fn raster<T>(file: &Path, name: &str, [width, height]: [usize; 2], values: Vec<T>) -> Result<Raster<T>> {
    Raster::from_vec(width, height, values).map_err(|error| array_error(file, name, error.to_string()))
}

pub(super) fn array_error(file: &Path, name: &str, reason: impl Into<String>) -> Error {
    Error::Array { file: file.to_path_buf(), array: name.to_owned(), reason: reason.into() }
}

pub(super) fn nothing_measured(file: &Path, name: &str, reason: impl Into<String>) -> Error {
    Error::NothingMeasured { file: file.to_path_buf(), array: name.to_owned(), reason: reason.into() }
}
