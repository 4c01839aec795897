//! Second differences of the phase: how smooth the surface is around each pixel.

use crate::grid::{Grid, wrapped};

/// Cost of a pixel none of whose neighbours allow a second difference: more than any pixel that has one.
const UNKNOWN: f32 = 256.0;

/// Second-difference cost of each pixel `[Herraez2002]`, rad^2; infinite where masked.
///
/// The four second differences (horizontal, vertical, two diagonals) of white noise of variance s^2 have an expected
/// sum of squares of 24 s^2. `noise_variance`, where given, adds that expectation, so that pixels whose second
/// differences are small by chance do not conduct.
pub(crate) fn pixel_cost(grid: &Grid, phase: &[f32], noise_variance: Option<&[f32]>, cost: &mut Vec<f32>) {
    cost.clear();
    cost.resize(grid.len(), f32::INFINITY);
    let stride = grid.stride;
    for start in grid.row_starts() {
        let row = |first: usize| &phase[first..first + grid.width + 2];
        let (above, here, below) = (row(start - 1 - stride), row(start - 1), row(start - 1 + stride));
        let out = &mut cost[start..start + grid.width];
        for ((out, here), (above, below)) in
            out.iter_mut().zip(here.windows(3)).zip(above.windows(3).zip(below.windows(3)))
        {
            *out = second_differences(above, here, below);
        }
    }
    if let Some(variance) = noise_variance {
        for (cost, variance) in cost.iter_mut().zip(variance) {
            *cost += 24.0 * variance;
        }
    }
}

#[inline]
fn second_differences(above: &[f32], here: &[f32], below: &[f32]) -> f32 {
    let centre = here[1];
    let (mut sum, mut count) = (0.0, 0.0);
    for (one, other) in [(here[0], here[2]), (above[1], below[1]), (above[0], below[2]), (above[2], below[0])] {
        let second = wrapped(one - centre) + wrapped(other - centre);
        // NaN marks a masked neighbour: this direction says nothing.
        let known = !second.is_nan();
        sum += if known { second * second } else { 0.0 };
        count += if known { 1.0 } else { 0.0 };
    }
    let cost = if count > 0.0 { sum * (4.0 / count) } else { UNKNOWN };
    if centre.is_nan() { f32::INFINITY } else { cost }
}

/// Reliability in (0, 1] that belongs to a cost: one on a smooth surface, half where the second differences reach pi.
#[inline]
pub(crate) fn reliability(cost: f32) -> f32 {
    let scale = std::f32::consts::PI * std::f32::consts::PI;
    scale / (scale + cost)
}
