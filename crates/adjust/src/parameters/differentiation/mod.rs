//! Derivatives without formulas: dual numbers and the arithmetic that models are written in.

pub(crate) mod dual;
pub(crate) mod real;
