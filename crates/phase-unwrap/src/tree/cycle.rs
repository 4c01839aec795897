//! Phases of any cycle: taken into `[0, 2 pi]` on the way in, their counts brought back to the phases given on the way out.

use std::borrow::Cow;
use std::f64::consts::TAU;

use range_image::Raster;

/// Values looked at together: without an early end they are compared side by side.
const BLOCK: usize = 1024;

/// The phase itself where all of it lies in `[0, 2 pi]` or is not finite, else a copy taken there.
pub(crate) fn into_cycle(phase: &Raster<f32>) -> Cow<'_, Raster<f32>> {
    if is_inside(phase) { Cow::Borrowed(phase) } else { Cow::Owned(phase.map(|&value| split(value).0)) }
}

/// As [`into_cycle`] for one raster a frequency or frame.
pub(crate) fn all_into_cycle(phases: &[Raster<f32>]) -> Cow<'_, [Raster<f32>]> {
    if phases.iter().all(is_inside) {
        Cow::Borrowed(phases)
    } else {
        Cow::Owned(phases.iter().map(|phase| into_cycle(phase).into_owned()).collect())
    }
}

/// Counts of phases taken into the cycle become those of the phases given, so that `phase + 2 pi wraps` stays what it was.
/// Pixels that are not `used` keep theirs.
pub(crate) fn count_from_given(phase: &Raster<f32>, used: impl Fn(usize) -> bool, wraps: &mut Raster<i32>) {
    if is_inside(phase) {
        return;
    }
    for (index, (wraps, &phase)) in wraps.as_mut_slice().iter_mut().zip(phase.as_slice()).enumerate() {
        if used(index) {
            *wraps = wraps.saturating_sub(split(phase).1);
        }
    }
}

/// A phase in `[0, 2 pi]` and the whole turns that were taken off it; what is not finite has none.
pub(crate) fn split(phase: f32) -> (f32, i32) {
    if !phase.is_finite() || (0.0..=std::f32::consts::TAU).contains(&phase) {
        return (phase, 0);
    }
    let turns = (f64::from(phase) / TAU).floor();
    let rest = (f64::from(phase) - turns * TAU) as f32;
    (rest.clamp(0.0, std::f32::consts::TAU), turns as i32)
}

fn is_inside(phase: &Raster<f32>) -> bool {
    let outside = |value: f32| value.is_finite() && !(0.0..=std::f32::consts::TAU).contains(&value);
    phase.as_slice().chunks(BLOCK).all(|block| !block.iter().fold(false, |any, &value| any | outside(value)))
}
