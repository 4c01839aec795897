use std::io::Read;

use crate::text::fault::Fault;
use crate::text::limits::LONGEST_ARRAY_HEADER;

/// Element types that are read and written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum DataType {
    /// `<f4`
    F32,
    /// `<f8`
    F64,
    /// `|u1`
    U8,
    /// `<u2`
    U16,
    /// `<i2`
    I16,
    /// `<i4`
    I32,
    /// `<i8`
    I64,
    /// `|b1`
    Bool,
}

impl DataType {
    const ALL: [Self; 8] = [Self::F32, Self::F64, Self::U8, Self::U16, Self::I16, Self::I32, Self::I64, Self::Bool];

    /// The type as numpy writes it, such as `<f4`.
    pub fn name(self) -> &'static str {
        match self {
            Self::F32 => "<f4",
            Self::F64 => "<f8",
            Self::U8 => "|u1",
            Self::U16 => "<u2",
            Self::I16 => "<i2",
            Self::I32 => "<i4",
            Self::I64 => "<i8",
            Self::Bool => "|b1",
        }
    }

    /// Bytes of one element.
    pub fn size(self) -> usize {
        match self {
            Self::U8 | Self::Bool => 1,
            Self::U16 | Self::I16 => 2,
            Self::F32 | Self::I32 => 4,
            Self::F64 | Self::I64 => 8,
        }
    }
}

/// What an array's header says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ArrayHeader {
    /// Element type.
    pub data_type: DataType,
    /// Length along each axis.
    pub shape: Vec<usize>,
}

const MAGIC: &[u8; 6] = b"\x93NUMPY";

impl ArrayHeader {
    /// Number of elements, `None` where it does not fit the machine.
    pub fn elements(&self) -> Option<usize> {
        self.shape.iter().try_fold(1_usize, |product, &n| product.checked_mul(n))
    }

    /// Number of bytes of the data, `None` where it does not fit the machine.
    pub fn bytes(&self) -> Option<usize> {
        self.elements()?.checked_mul(self.data_type.size())
    }

    /// Reads the header up to the first byte of the data, and counts its bytes; the error says what was expected.
    pub(super) fn read(reader: &mut impl Read) -> Result<(Self, usize), Fault> {
        let mut start = [0_u8; 8];
        read_exact(reader, &mut start)?;
        if start[..6] != *MAGIC {
            return Err("does not begin as an .npy file does".into());
        }
        let (length, prefix) = match start[6] {
            1 => {
                let mut bytes = [0_u8; 2];
                read_exact(reader, &mut bytes)?;
                (usize::from(u16::from_le_bytes(bytes)), 10)
            }
            2 | 3 => {
                let mut bytes = [0_u8; 4];
                read_exact(reader, &mut bytes)?;
                (u32::from_le_bytes(bytes) as usize, 12)
            }
            other => return Err(format!("is of .npy version {other}, expected 1, 2 or 3").into()),
        };
        if length > LONGEST_ARRAY_HEADER {
            return Err(format!("has a header of {length} bytes, expected at most {LONGEST_ARRAY_HEADER}").into());
        }
        let mut text = vec![0_u8; length];
        read_exact(reader, &mut text)?;
        let text = std::str::from_utf8(&text).map_err(|_| "has a header that is no text".to_owned())?;
        let header = Dictionary::new(text).header();
        let header = header.map_err(|reason| format!("has a header that is not understood: {reason}"))?;
        Ok((header, prefix + length))
    }

    /// The header as numpy writes it: version 1, the data aligned to 64 bytes.
    pub(super) fn to_bytes(&self) -> Vec<u8> {
        let axes: Vec<_> = self.shape.iter().map(usize::to_string).collect();
        // Python writes a tuple of one with a trailing comma and longer ones without.
        let comma = if axes.len() == 1 { "," } else { "" };
        let shape = axes.join(", ") + comma;
        let descr = self.data_type.name();
        let mut text = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({shape}), }}");
        let unpadded = MAGIC.len() + 4 + text.len() + 1;
        text.extend(std::iter::repeat_n(' ', unpadded.next_multiple_of(64) - unpadded));
        text.push('\n');
        let mut bytes = MAGIC.to_vec();
        bytes.extend([1, 0]);
        // Even twenty axes of twenty digits stay far below the 65535 bytes of a version 1 header.
        bytes.extend((text.len() as u16).to_le_bytes());
        bytes.extend(text.as_bytes());
        bytes
    }
}

fn read_exact(reader: &mut impl Read, bytes: &mut [u8]) -> Result<(), Fault> {
    reader.read_exact(bytes).map_err(Fault::at("ends within its header"))
}

/// Reader of the Python literal `{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }`.
struct Dictionary<'a> {
    rest: &'a str,
}

impl<'a> Dictionary<'a> {
    fn new(text: &'a str) -> Self {
        Self { rest: text.trim() }
    }

    fn header(mut self) -> Result<ArrayHeader, String> {
        let (mut data_type, mut c_order, mut shape) = (None, None, None);
        self.expect('{')?;
        while !self.take('}') {
            let key = self.string()?;
            self.expect(':')?;
            match key {
                "descr" => data_type = Some(self.data_type()?),
                "fortran_order" => c_order = Some(self.c_order()?),
                "shape" => shape = Some(self.shape()?),
                other => return Err(format!("unknown key `{other}`")),
            }
            if !self.take(',') {
                self.expect('}')?;
                break;
            }
        }
        c_order.ok_or("`fortran_order` is missing")?;
        Ok(ArrayHeader { data_type: data_type.ok_or("`descr` is missing")?, shape: shape.ok_or("`shape` is missing")? })
    }

    fn data_type(&mut self) -> Result<DataType, String> {
        if self.rest.starts_with('[') {
            return Err("a structured type, expected plain numbers".into());
        }
        let name = self.string()?;
        DataType::ALL.into_iter().find(|t| t.name() == name).ok_or_else(|| {
            let known: Vec<_> = DataType::ALL.iter().map(|t| t.name()).collect();
            format!("type `{name}`, expected one of {}", known.join(" "))
        })
    }

    fn c_order(&mut self) -> Result<(), String> {
        if self.keyword("False") {
            Ok(())
        } else if self.keyword("True") {
            Err("Fortran order, expected C order (numpy.ascontiguousarray makes it)".into())
        } else {
            Err("`fortran_order` is neither True nor False".into())
        }
    }

    fn shape(&mut self) -> Result<Vec<usize>, String> {
        let mut shape = Vec::new();
        self.expect('(')?;
        while !self.take(')') {
            let digits = self.rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(self.rest.len());
            let (number, rest) = self.rest.split_at(digits);
            shape.push(number.parse().map_err(|_| format!("`{number}` is no length of an axis"))?);
            self.rest = rest.trim_start();
            if !self.take(',') {
                self.expect(')')?;
                break;
            }
        }
        Ok(shape)
    }

    fn string(&mut self) -> Result<&'a str, String> {
        let quote = if self.rest.starts_with('"') { '"' } else { '\'' };
        self.expect(quote)?;
        let (text, rest) = self.rest.split_once(quote).ok_or("a string without its end")?;
        self.rest = rest.trim_start();
        Ok(text)
    }

    fn keyword(&mut self, word: &str) -> bool {
        let found = self.rest.strip_prefix(word);
        self.rest = found.unwrap_or(self.rest).trim_start();
        found.is_some()
    }

    fn take(&mut self, symbol: char) -> bool {
        let found = self.rest.strip_prefix(symbol);
        self.rest = found.unwrap_or(self.rest).trim_start();
        found.is_some()
    }

    fn expect(&mut self, symbol: char) -> Result<(), String> {
        if self.take(symbol) { Ok(()) } else { Err(format!("`{symbol}` is missing")) }
    }
}
