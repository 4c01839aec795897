//! Second differences of the phase: how smooth the surface is around each pixel.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use std::f32::consts::PI;

use range_image::with_wide_registers;

use crate::tree::grid::Grid;
use crate::tree::steps::wrapped_steps;

/// Cost of a pixel none of whose neighbours allow a second difference: more than any pixel that has one.
const UNKNOWN: f32 = 256.0;

/// Expected sum of squares of the four second differences of white noise of variance 1.
pub(crate) const EXPECTED: f32 = 24.0;

/// Wrapped steps of one padded row: along it, and to the row below (straight, and the two diagonals).
#[derive(Debug, Default)]
struct Steps {
    right: Vec<f32>,
    down: Vec<f32>,
    falling: Vec<f32>,
    rising: Vec<f32>,
}

/// Cost of the pixels; its rows of steps are kept for the next image.
#[derive(Debug, Default)]
pub(crate) struct Smoothness {
    above: Steps,
    here: Steps,
}

impl Smoothness {
    /// Second-difference cost of each pixel `[Herraez2002]`, rad^2; infinite where masked.
    ///
    /// The four second differences (horizontal, vertical, two diagonals) of white noise of variance s^2 have an
    /// expected sum of squares of 24 s^2. `noise_variance`, where given, adds that expectation, so that pixels whose
    /// second differences are small by chance do not conduct.
    pub fn measure(&mut self, grid: &Grid, phase: &[f32], noise_variance: Option<&[f32]>, cost: &mut Vec<f32>) {
        cost.clear();
        cost.resize(grid.len(), f32::INFINITY);
        with_wide_registers(
            #[inline(always)]
            || self.measure_rows(grid, phase, cost),
        );
        if let Some(variance) = noise_variance {
            for (cost, variance) in cost.iter_mut().zip(variance) {
                *cost += EXPECTED * variance;
            }
        }
    }

    #[inline(always)]
    fn measure_rows(&mut self, grid: &Grid, phase: &[f32], cost: &mut [f32]) {
        let row = |index: usize| &phase[index * grid.stride..][..grid.stride];
        self.above.measure(row(0), row(1));
        for index in 1..=grid.height {
            self.here.measure(row(index), row(index + 1));
            let out = &mut cost[index * grid.stride + 1..][..grid.width];
            second_differences(&row(index)[1..], &self.above, &self.here, out);
            std::mem::swap(&mut self.above, &mut self.here);
        }
    }
}

impl Steps {
    /// Steps from one padded row to the next; each serves the two pixels at its ends, which halves the work.
    #[inline(always)]
    fn measure(&mut self, here: &[f32], below: &[f32]) {
        wrapped_steps(here, &here[1..], &mut self.right);
        wrapped_steps(here, below, &mut self.down);
        wrapped_steps(here, &below[1..], &mut self.falling);
        // Stored under the column of the lower end.
        wrapped_steps(&here[1..], below, &mut self.rising);
    }
}

#[inline(always)]
fn second_differences(centre: &[f32], above: &Steps, here: &Steps, out: &mut [f32]) {
    let n = out.len();
    let (left, right) = (&here.right[..n], &here.right[1..][..n]);
    let (up, down) = (&above.down[1..][..n], &here.down[1..][..n]);
    let (up_left, down_right) = (&above.falling[..n], &here.falling[1..][..n]);
    let (up_right, down_left) = (&above.rising[1..][..n], &here.rising[..n]);
    let centre = &centre[..n];
    for col in 0..n {
        let (mut sum, mut count) = (0.0, 0.0);
        let seconds = [
            right[col] - left[col],
            down[col] - up[col],
            down_right[col] - up_left[col],
            down_left[col] - up_right[col],
        ];
        for second in seconds {
            // NaN marks a masked neighbour: this direction says nothing.
            let known = !second.is_nan();
            sum += if known { second * second } else { 0.0 };
            count += if known { 1.0 } else { 0.0 };
        }
        let cost = if count > 0.0 { sum * (4.0 / count) } else { UNKNOWN };
        out[col] = if centre[col].is_nan() { f32::INFINITY } else { cost };
    }
}

/// Cost of each pixel by its noise alone, in the scale of second differences; infinite where masked.
pub(crate) fn noise_cost(grid: &Grid, phase: &[f32], variance: &[f32], cost: &mut Vec<f32>) {
    cost.clear();
    cost.resize(grid.len(), f32::INFINITY);
    for start in grid.row_starts() {
        let inside = start..start + grid.width;
        let pixels = phase[inside.clone()].iter().zip(&variance[inside.clone()]);
        for (cost, (phase, variance)) in cost[inside].iter_mut().zip(pixels) {
            *cost = if phase.is_nan() { f32::INFINITY } else { EXPECTED * variance };
        }
    }
}

/// Reliability in (0, 1] that belongs to a cost: one on a smooth surface, half where the second differences reach pi.
#[inline(always)]
pub(crate) fn reliability(cost: f32) -> f32 {
    let scale = PI * PI;
    scale / (scale + cost)
}
