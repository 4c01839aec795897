use std::io::{BufRead, BufReader};
use std::path::Path;

use super::header::{Encoding, Field, Header};
use super::lzf;
use crate::formats::cloud_file::{CloudFile, Columns};
use crate::text::fault::{Fault, reserve, zeros};
use crate::text::lines::read_line;

/// Points decoded at a time.
const BLOCK: usize = 1 << 12;

/// Reads a PCD file, its fields in any order.
pub fn read_pcd(path: impl AsRef<Path>) -> crate::Result<CloudFile> {
    let path = path.as_ref();
    let (file, length) = crate::open(path)?;
    let read = read_from(&mut BufReader::with_capacity(1 << 16, file), length);
    read.map_err(|fault| fault.of(path))
}

/// `length` is the largest number of bytes that `reader` can give.
fn read_from(reader: &mut impl BufRead, length: u64) -> Result<CloudFile, Fault> {
    let header = Header::read(reader)?;
    let packing = match header.encoding {
        // One digit and one blank are the least that an ASCII number takes.
        Encoding::Ascii => 2 * header.fields.iter().map(|field| field.count).sum::<usize>() as u64,
        Encoding::Binary => header.point_size() as u64,
        Encoding::Compressed => header.point_size().div_ceil(lzf::LONGEST_REFERENCE) as u64,
    };
    if (header.points as u64).checked_mul(packing.max(1)).is_none_or(|bytes| bytes > length) {
        return Err(format!("promises {} points, more than its {length} bytes hold", header.points).into());
    }
    for field in &header.fields {
        let known = Columns::new([field.name.as_str()], 0).is_ok_and(|mut columns| columns.of_property(0).is_some());
        if known && field.count != 1 {
            return Err(format!("has {} values of `{}` a point, expected one", field.count, field.name).into());
        }
    }
    let mut columns = Columns::new(header.fields.iter().map(|field| field.name.as_str()), header.points)?;
    match header.encoding {
        Encoding::Ascii => read_ascii(reader, &header, &mut columns)?,
        Encoding::Binary => read_binary(reader, &header, &mut columns)?,
        Encoding::Compressed => read_compressed(reader, &header, length, &mut columns)?,
    }
    let mut cloud = columns.into_cloud(header.points)?;
    cloud.size = (header.height > 1).then_some([header.width, header.height]);
    cloud.world_from_cloud = header.viewpoint;
    Ok(cloud)
}

fn read_ascii(reader: &mut impl BufRead, header: &Header, columns: &mut Columns) -> Result<(), Fault> {
    let mut line = Vec::new();
    let values: usize = header.fields.iter().map(|field| field.count).sum();
    for point in 0..header.points {
        let text = read_line(reader, &mut line)?
            .ok_or_else(|| format!("ends before its last point: has {point} of {}", header.points))?;
        let mut words = text.split_ascii_whitespace();
        for (index, field) in header.fields.iter().enumerate() {
            for _ in 0..field.count {
                let word = words.next().ok_or_else(|| format!("has no `{}` in point {point}", field.name))?;
                if let Some(column) = columns.of_property(index) {
                    let value = word
                        .parse()
                        .map_err(|_| format!("has `{}` = `{word}` in point {point}, expected a number", field.name))?;
                    column.push(value);
                }
            }
        }
        if words.next().is_some() {
            return Err(format!("has more than {values} values in point {point}").into());
        }
    }
    Ok(())
}

fn read_binary(reader: &mut impl BufRead, header: &Header, columns: &mut Columns) -> Result<(), Fault> {
    let size = header.point_size();
    if size == 0 {
        return Ok(());
    }
    let mut block = zeros(size.saturating_mul(BLOCK.min(header.points)))?;
    for start in (0..header.points).step_by(BLOCK) {
        let bytes = &mut block[..size * BLOCK.min(header.points - start)];
        reader.read_exact(bytes).map_err(Fault::at("ends before its last point"))?;
        let mut offset = 0;
        for (index, field) in header.fields.iter().enumerate() {
            if let Some(column) = columns.of_property(index) {
                let end = offset + field.size;
                column.extend(bytes.chunks_exact(size).map(|point| decode(field, &point[offset..end])));
            }
            offset += field.bytes();
        }
    }
    Ok(())
}

/// All values of a field stand together, the fields one behind the other.
fn read_compressed(
    reader: &mut impl BufRead,
    header: &Header,
    length: u64,
    columns: &mut Columns,
) -> Result<(), Fault> {
    let mut sizes = [0_u8; 8];
    reader.read_exact(&mut sizes).map_err(Fault::at("ends before its points"))?;
    let [a, b, c, d, e, f, g, h] = sizes;
    let (packed, unpacked) = (u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h]) as usize);
    let expected = header.point_size().saturating_mul(header.points);
    if unpacked != expected {
        return Err(format!("has {unpacked} bytes of points once unpacked, expected {expected}").into());
    }
    if u64::from(packed) > length || !lzf::is_possible(packed as usize, unpacked) {
        return Err(format!("promises {unpacked} bytes packed into {packed}, more than its {length} bytes hold").into());
    }
    let mut bytes = zeros(packed as usize)?;
    reader.read_exact(&mut bytes).map_err(Fault::at("ends before its last point"))?;
    let mut room = reserve(unpacked)?;
    lzf::decompress(&bytes, unpacked, &mut room)
        .map_err(|reason| format!("has packed points: the packing {reason}"))?;
    let mut rest = room.as_slice();
    for (index, field) in header.fields.iter().enumerate() {
        let (values, behind) = rest.split_at(field.bytes() * header.points);
        if let Some(column) = columns.of_property(index) {
            column.extend(values.chunks_exact(field.size).map(|value| decode(field, value)));
        }
        rest = behind;
    }
    Ok(())
}

/// A little-endian value of a field; integers beyond 2⁵³ lose their last digits, which no attribute here has.
fn decode(field: &Field, bytes: &[u8]) -> f64 {
    // The slice has the field's size.
    fn array<const N: usize>(bytes: &[u8]) -> [u8; N] {
        bytes.first_chunk().copied().unwrap_or([0; N])
    }
    match (field.kind, field.size) {
        ('I', 1) => f64::from(i8::from_le_bytes(array(bytes))),
        ('I', 2) => f64::from(i16::from_le_bytes(array(bytes))),
        ('I', 4) => f64::from(i32::from_le_bytes(array(bytes))),
        ('I', _) => i64::from_le_bytes(array(bytes)) as f64,
        ('U', 1) => f64::from(u8::from_le_bytes(array(bytes))),
        ('U', 2) => f64::from(u16::from_le_bytes(array(bytes))),
        ('U', 4) => f64::from(u32::from_le_bytes(array(bytes))),
        ('U', _) => u64::from_le_bytes(array(bytes)) as f64,
        (_, 4) => f64::from(f32::from_le_bytes(array(bytes))),
        _ => f64::from_le_bytes(array(bytes)),
    }
}
