use std::borrow::Cow;
use std::str::FromStr;

use crate::text::fault::{Fault, collected, reserve};
use crate::text::limits::LONGEST_LINE;

/// Type of an array's values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Scalar {
    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// A big-endian value.
    fn decode(self, bytes: &[u8]) -> f64 {
        // The slice has the scalar's size.
        fn array<const N: usize>(bytes: &[u8]) -> [u8; N] {
            bytes.first_chunk().copied().unwrap_or([0; N])
        }
        match self {
            Self::I8 => f64::from(i8::from_be_bytes(array(bytes))),
            Self::U8 => f64::from(u8::from_be_bytes(array(bytes))),
            Self::I16 => f64::from(i16::from_be_bytes(array(bytes))),
            Self::U16 => f64::from(u16::from_be_bytes(array(bytes))),
            Self::I32 => f64::from(i32::from_be_bytes(array(bytes))),
            Self::U32 => f64::from(u32::from_be_bytes(array(bytes))),
            Self::I64 => i64::from_be_bytes(array(bytes)) as f64,
            Self::U64 => u64::from_be_bytes(array(bytes)) as f64,
            Self::F32 => f64::from(f32::from_be_bytes(array(bytes))),
            Self::F64 => f64::from_be_bytes(array(bytes)),
        }
    }
}

impl FromStr for Scalar {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Ok(match name.to_ascii_lowercase().as_str() {
            "char" => Self::I8,
            "unsigned_char" => Self::U8,
            "short" => Self::I16,
            "unsigned_short" => Self::U16,
            "int" => Self::I32,
            "unsigned_int" => Self::U32,
            "long" | "vtkidtype" | "vtktypeint64" => Self::I64,
            "unsigned_long" | "vtktypeuint64" => Self::U64,
            "float" => Self::F32,
            "double" => Self::F64,
            other => return Err(format!("has an array of unknown type `{other}`")),
        })
    }
}

/// A file's bytes, taken from the front.
pub(super) struct Source<'a> {
    rest: &'a [u8],
    pub binary: bool,
}

impl<'a> Source<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes, binary: false }
    }

    /// The next line, `None` at the end. The format is older than UTF-8: titles, names and comments may be in another
    /// encoding, whose bytes beyond ASCII are replaced.
    pub fn line(&mut self) -> Result<Option<Cow<'a, str>>, Fault> {
        if self.rest.is_empty() {
            return Ok(None);
        }
        let end = self.rest.iter().position(|byte| *byte == b'\n').unwrap_or(self.rest.len());
        if end as u64 > LONGEST_LINE {
            return Err(format!("has {end} bytes in a line, expected at most {LONGEST_LINE}").into());
        }
        let line = self.rest[..end].trim_ascii();
        self.rest = self.rest.get(end + 1..).unwrap_or_default();
        Ok(Some(String::from_utf8_lossy(line)))
    }

    /// The next line that is not empty.
    pub fn keyword_line(&mut self) -> Result<Option<Cow<'a, str>>, Fault> {
        while let Some(line) = self.line()? {
            if !line.is_empty() {
                return Ok(Some(line));
            }
        }
        Ok(None)
    }

    /// The next line that is not empty, left where it is.
    pub fn line_ahead(&self) -> Result<Option<Cow<'a, str>>, Fault> {
        Self { rest: self.rest, ..*self }.keyword_line()
    }

    /// Bytes that are not read yet.
    pub fn left(&self) -> usize {
        self.rest.len()
    }

    /// Passes over the next `count` values of an array.
    pub fn skip(&mut self, count: usize, scalar: Scalar, what: &str) -> Result<(), Fault> {
        if self.binary {
            let bytes = count.checked_mul(scalar.size()).and_then(|bytes| self.rest.get(bytes..));
            self.rest = bytes.ok_or_else(|| format!("ends within {what}, which promises {count} values"))?;
            return Ok(());
        }
        for index in 0..count {
            self.word().ok_or_else(|| format!("ends within {what}: has {index} of {count} values"))?;
        }
        Ok(())
    }

    /// The next `count` values of an array.
    pub fn values(&mut self, count: usize, scalar: Scalar, what: &str) -> Result<Vec<f64>, Fault> {
        // A binary value takes its size, one of ASCII at least a digit and a blank (the last no blank).
        let least = if self.binary { count.saturating_mul(scalar.size()) } else { count.saturating_mul(2) };
        if least > self.rest.len() + 1 {
            return Err(
                format!("promises {count} values of {what}, more than its {} bytes hold", self.rest.len()).into()
            );
        }
        if self.binary {
            let bytes = self.rest.get(..least).ok_or_else(|| format!("ends within {what}"))?;
            self.rest = &self.rest[least..];
            return Ok(collected(bytes.chunks_exact(scalar.size()).map(|value| scalar.decode(value)))?);
        }
        let mut values = reserve(count)?;
        for index in 0..count {
            let word = self.word().ok_or_else(|| format!("ends within {what}: has {index} of {count} values"))?;
            values.push(word.parse().map_err(|_| format!("has `{word}` in {what}, expected a number"))?);
        }
        Ok(values)
    }

    fn word(&mut self) -> Option<&'a str> {
        let start = self.rest.iter().position(|byte| !byte.is_ascii_whitespace())?;
        let length = self.rest[start..].iter().position(u8::is_ascii_whitespace).unwrap_or(self.rest.len() - start);
        let word = &self.rest[start..start + length];
        self.rest = &self.rest[start + length..];
        Some(std::str::from_utf8(word).unwrap_or("\u{fffd}"))
    }
}
