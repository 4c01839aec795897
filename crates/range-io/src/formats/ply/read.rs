use std::io::{BufRead, BufReader, Read, Seek};
use std::path::Path;

use super::header::{Encoding, Header, Scalar};
use crate::formats::cloud_file::{CloudFile, Columns};
use crate::text::fault::{Fault, zeros};
use crate::text::lines::read_line;

/// Vertices decoded at a time.
const BLOCK: usize = 1 << 12;

/// Reads the vertices of a PLY file, their properties in any order.
pub fn read_cloud(path: impl AsRef<Path>) -> crate::Result<CloudFile> {
    read_some_of_cloud(path, 0, usize::MAX)
}

/// The same of at most so many vertices from number `first` on; none where there are no more.
pub fn read_some_of_cloud(path: impl AsRef<Path>, first: u64, most: usize) -> crate::Result<CloudFile> {
    let path = path.as_ref();
    let (file, length) = crate::open(path)?;
    let read = read_from(&mut BufReader::with_capacity(1 << 16, file), length, first, most);
    read.map_err(|fault| fault.of(path))
}

/// `length` is the largest number of bytes that `reader` can give.
fn read_from(reader: &mut (impl BufRead + Seek), length: u64, first: u64, most: usize) -> Result<CloudFile, Fault> {
    let mut header = Header::read(reader)?;
    let vertices = header.vertices;
    if header.least_length().is_none_or(|bytes| bytes > length) {
        let before: Vec<_> = header.before.iter().map(|(count, _)| count.to_string()).collect();
        let before = if before.is_empty() { String::new() } else { format!(" behind {} elements", before.join(" + ")) };
        return Err(format!("promises {vertices} vertices{before}, more than its {length} bytes hold").into());
    }
    let first = first.min(vertices);
    let vertices = usize::try_from((vertices - first).min(most as u64)).map_err(|_| "has too many vertices")?;
    header.before.push((first, header.vertex_size()));
    let mut columns = Columns::new(header.properties.iter().map(|(name, _)| name.as_str()), vertices)?;
    match header.encoding {
        Encoding::Ascii => read_ascii(reader, &header, vertices, &mut columns)?,
        Encoding::LittleEndian => read_binary(reader, &header, vertices, &mut columns, little_endian)?,
        Encoding::BigEndian => read_binary(reader, &header, vertices, &mut columns, big_endian)?,
    }
    let mut cloud = columns.into_cloud(vertices)?;
    // A range grid of the Stanford kind has fewer vertices than cells: its points are in no order of pixels then.
    cloud.size = header.size.filter(|[width, height]| width.checked_mul(*height) == Some(vertices));
    cloud.world_from_cloud = header.world_from_cloud;
    Ok(cloud)
}

fn read_ascii(reader: &mut impl BufRead, header: &Header, vertices: usize, columns: &mut Columns) -> Result<(), Fault> {
    let mut line = Vec::new();
    for &(count, _) in &header.before {
        for _ in 0..count {
            read_line(reader, &mut line)?.ok_or("ends before its vertices")?;
        }
    }
    for vertex in 0..vertices {
        let text = read_line(reader, &mut line)?.ok_or("ends before its last vertex")?;
        let mut words = text.split_ascii_whitespace();
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
            return Err(format!("has more than {} values in vertex {vertex}", header.properties.len()).into());
        }
    }
    Ok(())
}

fn read_binary(
    reader: &mut (impl BufRead + Seek),
    header: &Header,
    vertices: usize,
    columns: &mut Columns,
    decode: fn(Scalar, &[u8]) -> f64,
) -> Result<(), Fault> {
    for &(count, size) in &header.before {
        let bytes = count.saturating_mul(size as u64);
        // What is no file on a disk cannot be gone along.
        let is_passed = i64::try_from(bytes).is_ok_and(|bytes| reader.seek_relative(bytes).is_ok());
        if !is_passed && std::io::copy(&mut reader.by_ref().take(bytes), &mut std::io::sink())? != bytes {
            return Err("ends before its vertices".into());
        }
    }
    let size = header.vertex_size();
    if size == 0 {
        return Ok(());
    }
    let mut block = zeros(size.saturating_mul(BLOCK.min(vertices)))?;
    for start in (0..vertices).step_by(BLOCK) {
        let bytes = &mut block[..size * BLOCK.min(vertices - start)];
        reader.read_exact(bytes).map_err(Fault::at("ends before its last vertex"))?;
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
