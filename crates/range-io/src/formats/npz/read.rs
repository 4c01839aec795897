use std::fs::File;
use std::io::{self, BufReader, Read, Seek};
use std::path::{Path, PathBuf};

use zip::ZipArchive;

use super::{Array, ArrayHeader, DataType, Values};
use crate::text::fault::{Fault, reserve, zeros};
use crate::text::limits::LARGEST_DEFLATION;
use crate::{Error, Result};

/// Elements converted at a time.
const BLOCK: usize = 1 << 14;

/// An open `.npz` archive.
#[derive(Debug)]
pub struct NpzReader<R> {
    file: PathBuf,
    archive: ZipArchive<R>,
    /// Bytes of the archive.
    length: u64,
}

impl NpzReader<BufReader<File>> {
    /// Opens an archive and reads its directory.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        Self::new(path, BufReader::with_capacity(1 << 16, crate::open(path)?.0))
    }
}

impl<R: Read + Seek> NpzReader<R> {
    /// Reads the directory of an archive; `name` stands for the file in messages.
    pub fn new(name: impl Into<PathBuf>, mut reader: R) -> Result<Self> {
        let file = name.into();
        let length = reader.seek(io::SeekFrom::End(0)).map_err(Error::io(&file, "find the size of"))?;
        let archive = ZipArchive::new(reader)
            .map_err(|error| Error::format(&file, format!("is not a complete .npz archive: {error}")))?;
        Ok(Self { file, archive, length })
    }

    /// Names of the arrays in the order of the archive.
    pub fn names(&self) -> Vec<String> {
        let names = self.archive.file_names_raw().map(String::from_utf8_lossy);
        names.map(|name| name.strip_suffix(".npy").unwrap_or(&name).to_owned()).collect()
    }

    /// Whether there is an array of the name.
    pub fn contains(&self, array: &str) -> bool {
        self.archive.index_for_name(&format!("{array}.npy")).is_some()
    }

    /// Reads an array; `accept` sees its header before anything is allocated and may refuse it.
    pub fn read(&mut self, array: &str, accept: impl FnOnce(&ArrayHeader) -> Result<()>) -> Result<Array> {
        let Some(index) = self.archive.index_for_name(&format!("{array}.npy")) else {
            return Err(self.missing(array));
        };
        let source = Source { file: &self.file, array };
        let mut member =
            self.archive.by_index(index).map_err(|error| source.error(format!("cannot be read: {error}")))?;
        // Both sizes are the directory's word.
        let packed = member.compressed_size().min(self.length);
        let bound = member.size().min(packed.saturating_mul(LARGEST_DEFLATION));
        source.read(&mut member, bound, accept)
    }

    fn missing(&self, array: &str) -> Error {
        let names: Vec<_> = self.names().iter().map(|name| format!("`{name}`")).collect();
        let present = if names.is_empty() { "an empty archive".to_owned() } else { names.join(", ") };
        Error::MissingArray { file: self.file.clone(), array: array.to_owned(), present }
    }
}

/// Reads a bare `.npy` file; `array` names it in messages, `accept` as in [`NpzReader::read`].
pub fn read_npy(path: impl AsRef<Path>, array: &str, accept: impl FnOnce(&ArrayHeader) -> Result<()>) -> Result<Array> {
    let path = path.as_ref();
    let (file, length) = crate::open(path)?;
    Source { file: path, array }.read(&mut BufReader::new(file), length, accept)
}

/// What messages name.
struct Source<'a> {
    file: &'a Path,
    array: &'a str,
}

impl Source<'_> {
    fn error(&self, reason: impl Into<String>) -> Error {
        Error::Array { file: self.file.to_path_buf(), array: self.array.to_owned(), reason: reason.into() }
    }

    fn fault(&self, fault: Fault) -> Error {
        fault.with(self.file, |reason| self.error(reason))
    }

    /// `bound` is the largest number of bytes that `reader` can give.
    fn read(
        &self,
        reader: &mut impl Read,
        bound: u64,
        accept: impl FnOnce(&ArrayHeader) -> Result<()>,
    ) -> Result<Array> {
        let (header, header_bytes) = ArrayHeader::read(reader).map_err(|fault| self.fault(fault))?;
        let bound = bound.saturating_sub(header_bytes as u64);
        match header.bytes() {
            Some(bytes) if bytes as u64 <= bound => {}
            _ => {
                let shape = &header.shape;
                return Err(
                    self.error(format!("promises shape {shape:?}, but the file holds at most {bound} bytes of it"))
                );
            }
        }
        accept(&header)?;
        let count = header.elements().unwrap_or(0);
        let values = read_values(reader, header.data_type, count).map_err(|error| {
            Fault::from(error).with(self.file, |reason| {
                self.error(format!("ends before its shape {:?} is filled: {reason}", header.shape))
            })
        })?;
        self.require_end(reader)?;
        Ok(Array { shape: header.shape, values })
    }

    /// Reading to the end also makes the archive check its checksum.
    fn require_end(&self, reader: &mut impl Read) -> Result<()> {
        let mut surplus = [0_u8; 1];
        match reader.read(&mut surplus) {
            Ok(0) => Ok(()),
            Ok(_) => Err(self.error("has more bytes than its shape takes")),
            Err(error) => Err(Fault::from(error).with(self.file, |reason| self.error(format!("is damaged: {reason}")))),
        }
    }
}

fn read_values(reader: &mut impl Read, data_type: DataType, count: usize) -> io::Result<Values> {
    Ok(match data_type {
        DataType::F32 => Values::F32(read_elements(reader, count, f32::from_le_bytes)?),
        DataType::F64 => Values::F64(read_elements(reader, count, f64::from_le_bytes)?),
        DataType::U8 => Values::U8(read_elements(reader, count, u8::from_le_bytes)?),
        DataType::U16 => Values::U16(read_elements(reader, count, u16::from_le_bytes)?),
        DataType::I16 => Values::I16(read_elements(reader, count, i16::from_le_bytes)?),
        DataType::I32 => Values::I32(read_elements(reader, count, i32::from_le_bytes)?),
        DataType::I64 => Values::I64(read_elements(reader, count, i64::from_le_bytes)?),
        DataType::Bool => Values::Bool(read_elements(reader, count, |[byte]: [u8; 1]| byte != 0)?),
    })
}

fn read_elements<T, const N: usize>(
    reader: &mut impl Read,
    count: usize,
    convert: impl Fn([u8; N]) -> T,
) -> io::Result<Vec<T>> {
    let mut elements = reserve(count)?;
    let mut block = zeros(BLOCK.min(count) * N)?;
    while elements.len() < count {
        let bytes = &mut block[..BLOCK.min(count - elements.len()) * N];
        reader.read_exact(bytes)?;
        elements.extend(bytes.as_chunks::<N>().0.iter().map(|&chunk| convert(chunk)));
    }
    Ok(elements)
}
