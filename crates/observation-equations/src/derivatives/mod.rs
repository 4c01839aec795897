//! Derivatives without formulas: dual numbers, the arithmetic that models are written in, and observations made of them.

pub(crate) mod differentiated;
pub(crate) mod dual;
pub(crate) mod real;
