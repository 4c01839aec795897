//! Checks of single fields; each names the field and the value it found.

use std::fmt::Debug;

use crate::{Error, Result};

/// Fails with the field's path and value unless `holds`.
pub(crate) fn require(holds: bool, field: impl Into<String>, value: &impl Debug, expected: &'static str) -> Result<()> {
    if holds { Ok(()) } else { Err(Error::Field { field: field.into(), value: format!("{value:?}"), expected }) }
}

/// A finite number.
pub(crate) fn finite(field: impl Into<String>, value: f64) -> Result<()> {
    require(value.is_finite(), field, &value, "a finite number")
}

/// A finite number above zero.
pub(crate) fn positive(field: impl Into<String>, value: f64) -> Result<()> {
    require(value.is_finite() && value > 0.0, field, &value, "a finite number above zero")
}

/// A finite number, zero or above.
pub(crate) fn not_negative(field: impl Into<String>, value: f64) -> Result<()> {
    require(value.is_finite() && value >= 0.0, field, &value, "a finite number, zero or above")
}

/// Finite coordinates.
pub(crate) fn finite_triple(field: impl Into<String>, value: &[f64; 3]) -> Result<()> {
    require(value.iter().all(|v| v.is_finite()), field, value, "three finite numbers")
}

/// Extents above zero.
pub(crate) fn positive_triple(field: impl Into<String>, value: &[f64; 3]) -> Result<()> {
    require(value.iter().all(|v| v.is_finite() && *v > 0.0), field, value, "three finite numbers above zero")
}
