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

/// Three finite numbers.
pub(crate) fn finite_triple(field: impl Into<String>, value: &[f64; 3]) -> Result<()> {
    require(value.iter().all(|v| v.is_finite()), field, value, "three finite numbers")
}

/// Furthest coordinate and largest extent: within it, f64 tells a nanometre, and no square overflows.
const FURTHEST_M: f64 = 1e6;
/// Smallest extent.
const SMALLEST_M: f64 = 1e-6;

/// Coordinates in metre.
pub(crate) fn coordinates(field: impl Into<String>, value: &[f64; 3]) -> Result<()> {
    require(value.iter().all(|v| v.abs() <= FURTHEST_M), field, value, "coordinates within 1e6 m")
}

/// A length in metre.
pub(crate) fn extent(field: impl Into<String>, value: f64) -> Result<()> {
    require((SMALLEST_M..=FURTHEST_M).contains(&value), field, &value, "a length from 1e-6 to 1e6 m")
}

/// Lengths in metre.
pub(crate) fn extents(field: impl Into<String>, value: &[f64; 3]) -> Result<()> {
    let holds = value.iter().all(|v| (SMALLEST_M..=FURTHEST_M).contains(v));
    require(holds, field, value, "three lengths from 1e-6 to 1e6 m")
}
