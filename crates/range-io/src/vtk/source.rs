use std::str::FromStr;

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

    /// The next line, `None` at the end.
    pub fn line(&mut self) -> Option<&'a str> {
        if self.rest.is_empty() {
            return None;
        }
        let end = self.rest.iter().position(|byte| *byte == b'\n').unwrap_or(self.rest.len());
        let line = &self.rest[..end];
        self.rest = self.rest.get(end + 1..).unwrap_or_default();
        std::str::from_utf8(line).ok().map(str::trim)
    }

    /// The next line that is not empty.
    pub fn keyword_line(&mut self) -> Option<&'a str> {
        loop {
            match self.line()? {
                "" => {}
                line => return Some(line),
            }
        }
    }

    /// The next line that is not empty, left where it is.
    pub fn line_ahead(&self) -> Option<&'a str> {
        Self { rest: self.rest, binary: self.binary }.keyword_line()
    }

    /// The next `count` values of an array.
    pub fn values(&mut self, count: usize, scalar: Scalar, what: &str) -> Result<Vec<f64>, String> {
        // A binary value takes its size, one of ASCII at least a digit and a blank (the last no blank).
        let least = if self.binary { count.saturating_mul(scalar.size()) } else { count.saturating_mul(2) };
        if least > self.rest.len() + 1 {
            return Err(format!("promises {count} values of {what}, more than its {} bytes hold", self.rest.len()));
        }
        if self.binary {
            let bytes = self.rest.get(..least).ok_or_else(|| format!("ends within {what}"))?;
            self.rest = &self.rest[least..];
            return Ok(bytes.chunks_exact(scalar.size()).map(|value| scalar.decode(value)).collect());
        }
        let mut values = Vec::with_capacity(count);
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
