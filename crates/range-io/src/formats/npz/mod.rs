//! numpy's `.npy` and `.npz`: arrays of numbers, little-endian, in C order.
//!
//! Read: versions 1 to 3 of the header, stored and deflated members, the types of [`DataType`]. Refused by name:
//! Fortran order, big-endian and structured types. A header that promises more bytes than the file can hold is refused
//! before anything is allocated.

mod header;
mod read;
mod write;

pub use header::{ArrayHeader, DataType};
pub use read::{NpzReader, read_npy};
pub use write::{Element, NpzWriter};

/// An array as a file holds it.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// Length along each axis, the last one running fastest; empty for a single number.
    pub shape: Vec<usize>,
    /// The values in C order.
    pub values: Values,
}

/// The values of an [`Array`], by type.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Values {
    /// `<f4`
    F32(Vec<f32>),
    /// `<f8`
    F64(Vec<f64>),
    /// `|u1`
    U8(Vec<u8>),
    /// `<u2`
    U16(Vec<u16>),
    /// `<i2`
    I16(Vec<i16>),
    /// `<i4`
    I32(Vec<i32>),
    /// `<i8`
    I64(Vec<i64>),
    /// `|b1`
    Bool(Vec<bool>),
}

impl Values {
    /// Number of values.
    pub fn len(&self) -> usize {
        match self {
            Self::F32(v) => v.len(),
            Self::F64(v) => v.len(),
            Self::U8(v) => v.len(),
            Self::U16(v) => v.len(),
            Self::I16(v) => v.len(),
            Self::I32(v) => v.len(),
            Self::I64(v) => v.len(),
            Self::Bool(v) => v.len(),
        }
    }

    /// Whether there is no value.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The values as single-precision numbers, rounded where the type is wider; `true` is 1.
    pub fn into_f32(self) -> Vec<f32> {
        match self {
            Self::F32(v) => v,
            Self::F64(v) => v.iter().map(|&x| x as f32).collect(),
            Self::U8(v) => v.iter().map(|&x| f32::from(x)).collect(),
            Self::U16(v) => v.iter().map(|&x| f32::from(x)).collect(),
            Self::I16(v) => v.iter().map(|&x| f32::from(x)).collect(),
            Self::I32(v) => v.iter().map(|&x| x as f32).collect(),
            Self::I64(v) => v.iter().map(|&x| x as f32).collect(),
            Self::Bool(v) => v.iter().map(|&x| f32::from(u8::from(x))).collect(),
        }
    }
}
