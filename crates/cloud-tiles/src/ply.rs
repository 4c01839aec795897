//! Binary little-endian PLY as streams of points: the files that commands write, of any length.

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use crate::{Error, Result};

/// Points that are read at a time.
const BLOCK: usize = 1 << 13;
/// Bytes of a line of the header, and lines, at most: as everywhere.
const LONGEST_LINE: u64 = 1 << 16;
const MOST_LINES: usize = 10_000;

/// Type of a property.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    U8,
    U16,
    U32,
    F32,
    F64,
}

/// A property of the points.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Property {
    pub(crate) name: String,
    pub(crate) kind: Kind,
    /// Where it begins in a point.
    pub(crate) at: usize,
}

/// A file of points.
pub(crate) struct PlyFile {
    path: PathBuf,
    pub(crate) points: u64,
    pub(crate) properties: Vec<Property>,
    /// Bytes of a point.
    pub(crate) length: usize,
    /// Where the points begin.
    start: u64,
}

impl Kind {
    pub(crate) fn bytes(self) -> usize {
        match self {
            Self::U8 => 1,
            Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "uchar" | "uint8" => Self::U8,
            "ushort" | "uint16" => Self::U16,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }
}

impl Property {
    /// Its value of a point; whole numbers as they are.
    pub(crate) fn of(&self, point: &[u8]) -> f64 {
        let bytes = &point[self.at..self.at + self.kind.bytes()];
        match *bytes {
            [a] => f64::from(a),
            [a, b] => f64::from(u16::from_le_bytes([a, b])),
            [a, b, c, d] if self.kind == Kind::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
            [a, b, c, d] => f64::from(f32::from_le_bytes([a, b, c, d])),
            [a, b, c, d, e, f, g, h] => f64::from_le_bytes([a, b, c, d, e, f, g, h]),
            _ => f64::NAN,
        }
    }
}

impl PlyFile {
    /// Reads the header, and holds what it says against the length of the file.
    pub(crate) fn open(path: &Path) -> Result<Self> {
        let file = File::open(path).map_err(Error::io(path))?;
        let size = file.metadata().map_err(Error::io(path))?.len();
        let mut reader = BufReader::new(file);
        let mut all = Self { path: path.to_owned(), points: 0, properties: Vec::new(), length: 0, start: 0 };
        let mut elements = 0;
        for number in 0.. {
            let mut line = Vec::new();
            let read = (&mut reader).take(LONGEST_LINE).read_until(b'\n', &mut line).map_err(Error::io(path))?;
            if read == 0 || line.last() != Some(&b'\n') || number == MOST_LINES {
                return Err(Error::format(path, "has no header that ends, expected `end_header`"));
            }
            all.start += read as u64;
            let line = String::from_utf8_lossy(&line).into_owned();
            let words: Vec<&str> = line.split_whitespace().collect();
            match (number, words.as_slice()) {
                (0, ["ply"]) | (1, ["format", "binary_little_endian", _]) | (2.., ["comment" | "obj_info", ..]) => {}
                (0, _) => return Err(Error::format(path, "is no PLY file, expected `ply` in its first line")),
                (2.., ["element", "vertex", count]) if elements == 0 => {
                    elements += 1;
                    all.points = count.parse().map_err(|_| Error::format(path, format!("has {count:?} points")))?;
                }
                (2.., ["property", kind, name]) if elements == 1 => all.add(kind, name)?,
                (2.., ["end_header"]) => break,
                _ => {
                    let reason = format!("has the line {line:?}, expected points alone, binary little-endian");
                    return Err(Error::format(path, reason));
                }
            }
        }
        let needed = all.points.checked_mul(all.length as u64).and_then(|bytes| bytes.checked_add(all.start));
        if all.length == 0 || needed.is_none_or(|needed| needed > size) {
            let reason = format!("has {size} bytes, too few for {} points of {} bytes", all.points, all.length);
            return Err(Error::format(path, reason));
        }
        Ok(all)
    }

    fn add(&mut self, kind: &str, name: &str) -> Result<()> {
        let Some(kind) = Kind::named(kind) else {
            return Err(Error::format(&self.path, format!("has property `{name}` of the type {kind:?}")));
        };
        if self.property(name).is_some() {
            return Err(Error::format(&self.path, format!("has property `{name}` twice")));
        }
        self.properties.push(Property { name: name.to_owned(), kind, at: self.length });
        self.length += kind.bytes();
        Ok(())
    }

    pub(crate) fn property(&self, name: &str) -> Option<&Property> {
        self.properties.iter().find(|property| property.name == name)
    }

    /// The coordinates.
    pub(crate) fn position(&self) -> Result<[&Property; 3]> {
        match ["x", "y", "z"].map(|name| self.property(name)) {
            [Some(x), Some(y), Some(z)] => Ok([x, y, z]),
            _ => Err(Error::format(&self.path, "has no properties `x`, `y` and `z`")),
        }
    }

    /// All points, in their order.
    pub(crate) fn each(&self, mut see: impl FnMut(&[u8]) -> Result<()>) -> Result<()> {
        let fail = Error::io(&self.path);
        let mut file = File::open(&self.path).map_err(&fail)?;
        file.seek(SeekFrom::Start(self.start)).map_err(&fail)?;
        let mut block = vec![0; BLOCK * self.length];
        let mut left = self.points;
        while left > 0 {
            let count = left.min(BLOCK as u64);
            let block = &mut block[..count as usize * self.length];
            file.read_exact(block).map_err(&fail)?;
            block.chunks_exact(self.length).try_for_each(&mut see)?;
            left -= count;
        }
        Ok(())
    }
}
