//! Inputs and options refused with what is wrong with them.

use nalgebra::{Isometry3, Point3};

use crate::error::{InputError, Result};

/// Largest coordinate, metre: its square, and sums of such, are finite.
const LARGEST_COORDINATE: f64 = 1e100;

/// Refuses an option outside its `domain`, which is told in words and tested by `is_inside`.
///
/// # Errors
/// [`InputError::InvalidOption`].
pub fn require_option(
    name: &'static str,
    value: f64,
    domain: &'static str,
    is_inside: impl FnOnce(f64) -> bool,
) -> Result<()> {
    if is_inside(value) { Ok(()) } else { Err(InputError::InvalidOption { name, value, domain }) }
}

/// Refuses an option that is given and not positive and finite.
///
/// # Errors
/// [`InputError::InvalidOption`].
pub fn require_positive(name: &'static str, value: impl Into<Option<f64>>) -> Result<()> {
    let Some(value) = value.into() else { return Ok(()) };
    require_option(name, value, "positive and finite", |value| value > 0.0 && value.is_finite())
}

/// Refuses a count below `least` (1 to 6).
///
/// # Errors
/// [`InputError::InvalidOption`].
pub fn require_count(name: &'static str, count: usize, least: usize) -> Result<()> {
    let domains = ["1 or more", "2 or more", "3 or more", "4 or more", "5 or more", "6 or more"];
    require_option(name, count as f64, domains[least.clamp(1, 6) - 1], |_| count >= least)
}

/// Refuses an input that is given and has not as many entries as it should.
///
/// # Errors
/// [`InputError::LengthMismatch`].
pub fn require_length(what: &'static str, expected: usize, found: impl Into<Option<usize>>) -> Result<()> {
    match found.into() {
        Some(found) if found != expected => Err(InputError::LengthMismatch { what, expected, found }),
        _ => Ok(()),
    }
}

/// Refuses a pose with a number that is not finite.
///
/// # Errors
/// [`InputError::NonFinite`].
pub fn require_pose(what: &'static str, pose: &Isometry3<f64>) -> Result<()> {
    if is_finite(pose) { Ok(()) } else { Err(InputError::NonFinite { what, index: 0 }) }
}

/// Refuses coordinates that are not finite (or too large to be squared); `what` names the points.
///
/// # Errors
/// [`InputError::NonFinite`] with the index of the first one.
pub fn require_points(what: &'static str, points: &[Point3<f64>]) -> Result<()> {
    match points.iter().position(|point| !is_usable(point)) {
        Some(index) => Err(InputError::NonFinite { what, index }),
        None => Ok(()),
    }
}

/// Whether all numbers of a pose are finite.
#[must_use]
pub fn is_finite(pose: &Isometry3<f64>) -> bool {
    is_usable(&pose.translation.vector.into()) && pose.rotation.coords.iter().all(|v| v.is_finite())
}

/// Whether all three coordinates are finite and small enough to be squared.
#[must_use]
pub fn is_usable(point: &Point3<f64>) -> bool {
    // NaN fails the comparison.
    point.iter().all(|c| c.abs() < LARGEST_COORDINATE)
}
