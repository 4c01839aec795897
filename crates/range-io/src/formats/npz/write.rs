use std::io::{Seek, Write};
use std::path::{Path, PathBuf};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::{ArrayHeader, DataType};
use crate::{Error, Result};
use atomic_output::FileWriter;

/// Elements converted at a time.
const BLOCK: usize = 1 << 14;
/// Noise does not compress: slower levels take more time and hardly less room on measured frames.
const LEVEL: i64 = 1;

/// A type whose arrays are written.
pub trait Element: Copy {
    /// Its name in files.
    const DATA_TYPE: DataType;

    /// Appends the little-endian bytes.
    fn append(self, bytes: &mut Vec<u8>);
}

macro_rules! element {
    ($($number:ty => $data_type:ident),*) => {$(
        impl Element for $number {
            const DATA_TYPE: DataType = DataType::$data_type;

            fn append(self, bytes: &mut Vec<u8>) {
                bytes.extend_from_slice(&self.to_le_bytes());
            }
        }
    )*};
}
element!(f32 => F32, f64 => F64, u8 => U8, u16 => U16, i16 => I16, i32 => I32, i64 => I64);

impl Element for bool {
    const DATA_TYPE: DataType = DataType::Bool;

    fn append(self, bytes: &mut Vec<u8>) {
        bytes.push(u8::from(self));
    }
}

/// Writer of an `.npz` archive with deflated members.
pub struct NpzWriter<W: Write + Seek> {
    file: PathBuf,
    archive: ZipWriter<W>,
}

impl NpzWriter<FileWriter> {
    /// Begins an archive that appears under its name at [`NpzWriter::commit`].
    pub fn create(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        Ok(Self::new(path, FileWriter::create(path)?))
    }

    /// Ends the archive and gives it its name.
    pub fn commit(self) -> Result<()> {
        Ok(self.finish()?.commit()?)
    }
}

impl<W: Write + Seek> NpzWriter<W> {
    /// Begins an archive; `name` stands for the file in messages.
    pub fn new(name: impl Into<PathBuf>, writer: W) -> Self {
        Self { file: name.into(), archive: ZipWriter::new(writer) }
    }

    /// Adds an array; the product of `shape` must be the number of `values`.
    pub fn add<T: Element>(&mut self, array: &str, shape: &[usize], values: &[T]) -> Result<()> {
        let header = ArrayHeader { data_type: T::DATA_TYPE, shape: shape.to_vec() };
        if header.elements() != Some(values.len()) {
            return Err(self.error(array, format!("was given {} values for shape {shape:?}", values.len())));
        }
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Deflated)
            .compression_level(Some(LEVEL))
            .large_file(header.bytes().is_none_or(|bytes| bytes >= 1 << 31));
        let started = self.archive.start_file(format!("{array}.npy"), options);
        started.map_err(|error| Error::io(&self.file, "begin an array of")(error.into()))?;
        self.write(&header, values).map_err(Error::io(&self.file, "write"))
    }

    fn write<T: Element>(&mut self, header: &ArrayHeader, values: &[T]) -> std::io::Result<()> {
        self.archive.write_all(&header.to_bytes())?;
        let mut bytes = Vec::with_capacity(BLOCK.min(values.len()) * T::DATA_TYPE.size());
        for block in values.chunks(BLOCK) {
            bytes.clear();
            for value in block {
                value.append(&mut bytes);
            }
            self.archive.write_all(&bytes)?;
        }
        Ok(())
    }

    /// Ends the archive and gives the writer back.
    pub fn finish(self) -> Result<W> {
        let Self { file, archive } = self;
        archive.finish().map_err(|error| Error::io(&file, "finish")(error.into()))
    }

    fn error(&self, array: &str, reason: String) -> Error {
        Error::Array { file: self.file.clone(), array: array.to_owned(), reason }
    }
}
