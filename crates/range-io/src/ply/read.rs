use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use super::header::{Encoding, Header, Scalar};
use super::{COVARIANCE, CloudFile, NORMAL, POSITION};
use crate::Error;

/// Vertices decoded at a time.
const BLOCK: usize = 1 << 12;

/// Reads the vertices of a PLY file, their properties in any order.
pub fn read_cloud(path: impl AsRef<Path>) -> crate::Result<CloudFile> {
    let path = path.as_ref();
    let file = File::open(path).map_err(Error::io(path, "open"))?;
    let length = file.metadata().map_err(Error::io(path, "find the size of"))?.len();
    let read = read_from(&mut BufReader::with_capacity(1 << 16, file), length);
    read.map_err(|reason| Error::format(path, reason))
}

/// `length` is the largest number of bytes that `reader` can give.
fn read_from(reader: &mut impl BufRead, length: u64) -> Result<CloudFile, String> {
    let header = Header::read(reader)?;
    // One digit and one blank are the least that an ASCII number takes.
    let vertex_size = match header.encoding {
        Encoding::Ascii => 2 * header.properties.len(),
        _ => header.vertex_size(),
    };
    let vertices = header.vertices;
    if vertices.checked_mul(vertex_size.max(1) as u64).is_none_or(|bytes| bytes > length) {
        return Err(format!("promises {vertices} vertices, more than its {length} bytes hold"));
    }
    let vertices = vertices as usize;
    let mut columns = Columns::new(&header.properties, vertices)?;
    match header.encoding {
        Encoding::Ascii => read_ascii(reader, &header, vertices, &mut columns)?,
        Encoding::LittleEndian => read_binary(reader, &header, vertices, &mut columns, little_endian)?,
        Encoding::BigEndian => read_binary(reader, &header, vertices, &mut columns, big_endian)?,
    }
    columns.into_cloud(vertices)
}

fn read_ascii(
    reader: &mut impl BufRead,
    header: &Header,
    vertices: usize,
    columns: &mut Columns,
) -> Result<(), String> {
    let mut line = String::new();
    let mut next = |line: &mut String| -> Result<(), String> {
        line.clear();
        match reader.read_line(line) {
            Ok(0) => Err("ends before its last vertex".into()),
            Ok(_) => Ok(()),
            Err(error) => Err(format!("cannot be read: {error}")),
        }
    };
    for _ in 0..header.before.iter().map(|(count, _)| *count).sum::<u64>() {
        next(&mut line)?;
    }
    for vertex in 0..vertices {
        next(&mut line)?;
        let mut words = line.split_ascii_whitespace();
        for (index, (name, _)) in header.properties.iter().enumerate() {
            let word = words.next().ok_or_else(|| format!("has no `{name}` in vertex {vertex}"))?;
            if let Some(column) = columns.of_property(index) {
                let value = word
                    .parse()
                    .map_err(|_| format!("has `{name}` = `{word}` in vertex {vertex}, expected a number"))?;
                column.push(value);
            }
        }
        if words.next().is_some() {
            return Err(format!("has more than {} values in vertex {vertex}", header.properties.len()));
        }
    }
    Ok(())
}

fn read_binary(
    reader: &mut impl BufRead,
    header: &Header,
    vertices: usize,
    columns: &mut Columns,
    decode: fn(Scalar, &[u8]) -> f64,
) -> Result<(), String> {
    for &(count, size) in &header.before {
        let bytes = count.saturating_mul(size as u64);
        let skipped = std::io::copy(&mut reader.by_ref().take(bytes), &mut std::io::sink());
        if skipped.map_err(|error| format!("cannot be read: {error}"))? != bytes {
            return Err("ends before its vertices".into());
        }
    }
    let size = header.vertex_size();
    let mut block = vec![0_u8; size * BLOCK.min(vertices)];
    for start in (0..vertices).step_by(BLOCK) {
        let bytes = &mut block[..size * BLOCK.min(vertices - start)];
        reader.read_exact(bytes).map_err(|error| format!("ends before its last vertex: {error}"))?;
        let mut offset = 0;
        for (index, (_, scalar)) in header.properties.iter().enumerate() {
            if let Some(column) = columns.of_property(index) {
                column.extend(
                    bytes.chunks_exact(size).map(|vertex| decode(*scalar, &vertex[offset..offset + scalar.size()])),
                );
            }
            offset += scalar.size();
        }
    }
    Ok(())
}

macro_rules! decoder {
    ($name:ident, $from:ident) => {
        fn $name(scalar: Scalar, bytes: &[u8]) -> f64 {
            // The slice has the scalar's size.
            fn array<const N: usize>(bytes: &[u8]) -> [u8; N] {
                bytes.first_chunk().copied().unwrap_or([0; N])
            }
            match scalar {
                Scalar::I8 => f64::from(i8::$from(array(bytes))),
                Scalar::U8 => f64::from(u8::$from(array(bytes))),
                Scalar::I16 => f64::from(i16::$from(array(bytes))),
                Scalar::U16 => f64::from(u16::$from(array(bytes))),
                Scalar::I32 => f64::from(i32::$from(array(bytes))),
                Scalar::U32 => f64::from(u32::$from(array(bytes))),
                Scalar::F32 => f64::from(f32::$from(array(bytes))),
                Scalar::F64 => f64::$from(array(bytes)),
            }
        }
    };
}
decoder!(little_endian, from_le_bytes);
decoder!(big_endian, from_be_bytes);

/// The recognised properties as columns.
struct Columns {
    /// Canonical names with their values.
    columns: Vec<(String, Vec<f64>)>,
    /// Position among the columns of each property of a vertex.
    of_property: Vec<Option<usize>>,
}

impl Columns {
    fn new(properties: &[(String, Scalar)], vertices: usize) -> Result<Self, String> {
        const SINGLE: [&str; 4] = ["intensity", "sigma", "flags", "frame"];
        let known = || POSITION.iter().chain(&NORMAL).chain(&COVARIANCE).chain(&SINGLE);
        let mut columns: Vec<(String, Vec<f64>)> = Vec::new();
        let mut of_property = Vec::new();
        for (name, _) in properties {
            let canonical = name.to_ascii_lowercase();
            let canonical = canonical.strip_prefix("scalar_").unwrap_or(&canonical);
            if !known().any(|known| *known == canonical) {
                of_property.push(None);
                continue;
            }
            if columns.iter().any(|(earlier, _)| earlier == canonical) {
                return Err(format!("has property `{canonical}` twice"));
            }
            of_property.push(Some(columns.len()));
            columns.push((canonical.to_owned(), Vec::with_capacity(vertices)));
        }
        Ok(Self { columns, of_property })
    }

    fn of_property(&mut self, index: usize) -> Option<&mut Vec<f64>> {
        let column = self.of_property.get(index).copied().flatten()?;
        self.columns.get_mut(column).map(|(_, values)| values)
    }

    fn into_cloud(mut self, vertices: usize) -> Result<CloudFile, String> {
        let points = self.take_all(POSITION)?.ok_or("has no properties `x`, `y`, `z`")?;
        let normals = self.take_all(NORMAL)?;
        let covariance = self.take_all(COVARIANCE)?;
        Ok(CloudFile {
            points: (0..vertices).map(|i| std::array::from_fn(|axis| points[axis][i])).collect(),
            normals: normals.map(|n| (0..vertices).map(|i| std::array::from_fn(|axis| n[axis][i] as f32)).collect()),
            covariance: covariance
                .map(|c| (0..vertices).map(|i| std::array::from_fn(|term| c[term][i] as f32)).collect()),
            intensity: self.take("intensity").map(|values| values.iter().map(|&value| value as f32).collect()),
            sigma: self.take("sigma").map(|values| values.iter().map(|&value| value as f32).collect()),
            flags: self
                .take("flags")
                .map(|values| whole("flags", &values, f64::from(u16::MAX), |v| v as u16))
                .transpose()?,
            frame: self
                .take("frame")
                .map(|values| whole("frame", &values, f64::from(u32::MAX), |v| v as u32))
                .transpose()?,
        })
    }

    fn take(&mut self, name: &str) -> Option<Vec<f64>> {
        let index = self.columns.iter().position(|(found, _)| found == name)?;
        Some(std::mem::take(&mut self.columns[index].1))
    }

    /// Columns of which all or none must be there.
    fn take_all<const N: usize>(&mut self, names: [&str; N]) -> Result<Option<[Vec<f64>; N]>, String> {
        let columns = names.map(|name| self.take(name));
        let found = columns.iter().flatten().count();
        match found {
            0 => Ok(None),
            _ if found == N => Ok(Some(columns.map(Option::unwrap_or_default))),
            _ => Err(format!("has {found} of the properties {}, expected all or none", names.join(", "))),
        }
    }
}

/// Values that must be whole numbers from 0 to `largest`.
fn whole<T>(name: &str, values: &[f64], largest: f64, convert: fn(f64) -> T) -> Result<Vec<T>, String> {
    let bad = values.iter().find(|value| !(value.fract() == 0.0 && (0.0..=largest).contains(*value)));
    match bad {
        Some(value) => Err(format!("has `{name}` = {value}, expected a whole number from 0 to {largest}")),
        None => Ok(values.iter().map(|&value| convert(value)).collect()),
    }
}
