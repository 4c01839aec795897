//! Angles between normals and axes.

use nalgebra::Vector3;

use super::{Direction, Quantity, Unit, sum};
use crate::region::across;

/// Angle between two directions, of which it does not matter which way they point: from 0 to π/2.
///
/// A small angle is the length of a vector of two tilts, and the interval knows it: of parallel planes it begins at zero.
pub fn angle(first: &Direction, second: &Direction) -> Quantity {
    let one = first.vector.into_inner();
    let sign = if one.dot(&second.vector) < 0.0 { -1.0 } else { 1.0 };
    let two = second.vector.into_inner() * sign;
    let turn = one.cross(&two);
    let value = turn.norm().atan2(one.dot(&two));
    let about: Vector3<f64> = turn.try_normalize(f64::MIN_POSITIVE).unwrap_or_else(|| across(&one)[0]);
    // Where each moves as the angle grows.
    let [away, onward] = [about.cross(&one), about.cross(&two)];
    let gradient = sum(&[(&second.towards(&onward), sign), (&first.towards(&away), -1.0)]);
    let aside = sum(&[(&second.towards(&about), sign), (&first.towards(&about), -1.0)]);
    Quantity { value, unit: Unit::Radian, gradient, across: vec![aside] }
}
