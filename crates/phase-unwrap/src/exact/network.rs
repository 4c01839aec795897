//! The dual network: loops of four pixels are its nodes, steps between neighbouring pixels its edges.
//!
//! Node f is the loop of the padded pixels f, f + 1, f + stride + 1, f + stride, walked in this order. The step from
//! pixel p to p + 1 separates the loops p - stride (above) and p; the step from p to p + stride the loops p - 1 and p.

use std::f32::consts::{PI, TAU};

use range_image::Raster;

use super::CutPrice;
use crate::tree::grid::{Grid, wrap_step, wrapped};

/// Largest price of an edge; the smallest is 1, and 0 marks a step that a masked pixel takes away. Finer prices change
/// few cuts and lengthen the circle of buckets.
pub(super) const LARGEST_PRICE: u8 = 100;
/// Mark of a step whose price was never asked for.
pub(super) const UNPRICED: u8 = u8::MAX;
/// Share of the weights that lie below the one that gets the full price. Single outstanding weights would otherwise
/// make all other steps cheap alike.
const WEIGHT_QUANTILE: f32 = 0.95;

/// Steps to the right neighbour and to the neighbour below, for each padded pixel.
#[derive(Debug, Default)]
pub(super) struct Network {
    /// Prices: \[right, down\]; 0 where there is no step, `UNPRICED` where no search came by.
    pub price: [Vec<u8>; 2],
    /// Cycles added to the smaller steps: \[right, down\].
    pub added: [Vec<i32>; 2],
    /// Whole cycles by which the smaller steps miss around each loop, as they were and as they are.
    pub residue: Vec<i8>,
    rule: CutPrice,
    weighted: bool,
    quality: Vec<f32>,
    sorted: Vec<f32>,
}

impl Network {
    /// Finds the steps that there are, and the residues.
    pub fn build(&mut self, grid: &Grid, phase: &[f32]) {
        for (axis, step) in [1, grid.stride].into_iter().enumerate() {
            self.added[axis].clear();
            self.added[axis].resize(grid.len(), 0);
            let prices = &mut self.price[axis];
            prices.clear();
            prices.resize(grid.len(), 0);
            let steps = phase.iter().zip(&phase[step..]);
            for (price, (from, to)) in prices.iter_mut().zip(steps) {
                *price = if (to - from).is_nan() { 0 } else { UNPRICED };
            }
        }
        self.load_residues(grid, phase);
    }

    /// How steps are to be priced when a search comes by.
    pub fn set_prices(&mut self, grid: &Grid, price: CutPrice, weights: Option<&Raster<f32>>) {
        self.rule = price;
        self.weighted = weights.is_some();
        self.load_quality(grid, weights);
    }

    /// Price of a step, computed when it is asked for the first time; 0 where there is none.
    #[inline]
    pub fn price(&mut self, phase: &[f32], axis: usize, pixel: usize, step: usize) -> u8 {
        match self.price[axis][pixel] {
            UNPRICED => {
                let share = match self.rule {
                    CutPrice::Uniform => 1.0,
                    CutPrice::Smoothness => smoothness(phase, pixel, step),
                };
                let quality = if self.weighted { self.quality[pixel].min(self.quality[pixel + step]) } else { 1.0 };
                // At least 1: a free edge would leave the choice of the path to chance.
                let price = 1 + (f32::from(LARGEST_PRICE - 1) * share * quality).round() as u8;
                self.price[axis][pixel] = price;
                price
            }
            price => price,
        }
    }

    /// Weights over their quantile, at most 1.
    fn load_quality(&mut self, grid: &Grid, weights: Option<&Raster<f32>>) {
        let Some(weights) = weights else { return };
        grid.pad(weights, 0.0, &mut self.quality);
        for quality in &mut self.quality {
            *quality = if quality.is_finite() { quality.max(0.0) } else { 0.0 };
        }
        self.sorted.clear();
        self.sorted.extend(self.quality.iter().filter(|quality| **quality > 0.0));
        let index = (self.sorted.len() as f32 * WEIGHT_QUANTILE) as usize;
        let full =
            if index < self.sorted.len() { *self.sorted.select_nth_unstable_by(index, f32::total_cmp).1 } else { 1.0 };
        for quality in &mut self.quality {
            *quality = (*quality / full).min(1.0);
        }
    }

    fn load_residues(&mut self, grid: &Grid, phase: &[f32]) {
        self.residue.clear();
        self.residue.resize(grid.len(), 0);
        let stride = grid.stride;
        let count = |from: usize, to: usize| wrap_step(phase[from], phase[to]) as i8;
        for f in 0..grid.len() - stride - 1 {
            let (right, below, across) = (f + 1, f + stride, f + stride + 1);
            // Steps at masked pixels count nothing: comparisons with NaN are false.
            self.residue[f] = count(f, right) + count(right, across) - count(below, across) - count(f, below);
        }
    }
}

/// 0 to 1: how sure the smaller step from a pixel to its neighbour is.
///
/// Second differences along the step, where the pixels beyond are known, lower it as `pi^2 / (pi^2 + sum of squares)`;
/// so does a step that comes near half a cycle.
fn smoothness(phase: &[f32], pixel: usize, step: usize) -> f32 {
    let difference = |from: usize| wrapped(phase[from + step] - phase[from]);
    let here = difference(pixel);
    let second = |other: f32| if other.is_nan() { 0.0 } else { wrapped_any(other - here).powi(2) };
    let before = second(difference(pixel - step));
    let after = if pixel + 2 * step < phase.len() { second(difference(pixel + step)) } else { 0.0 };
    PI * PI / (PI * PI + 4.0 * (before + after)) * (1.0 - here.abs() / PI)
}

/// Brings a difference of two wrapped differences into `[-pi, pi]`.
fn wrapped_any(value: f32) -> f32 {
    value - TAU * (value / TAU).round()
}
