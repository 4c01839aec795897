//! Gaussians between pixels and blocks of pixels, one axis at a time.
//!
//! The mean over a block of an image convolved with a Gaussian is a linear function of the image, and separable: with a
//! matrix for each axis it is exact, borders included, without transforms and without interpolation.

use std::f64::consts::TAU;

use nalgebra::DMatrix;

use crate::estimate::views::blocks::Blocks;

/// Blurring along one axis, and its derivative with respect to the logarithm of the width.
pub(in crate::estimate) struct AxisBlur {
    /// Blocks x pixels: light that a block gets on average from a pixel.
    pub(in crate::estimate) from_pixels: [DMatrix<f64>; 2],
    /// Blocks x blocks: light that a block gets on average when every pixel of another block has light 1.
    pub(in crate::estimate) from_blocks: [DMatrix<f64>; 2],
}

impl AxisBlur {
    pub(in crate::estimate) fn new(blocks: &Blocks, axis: usize, sigma: f64) -> Self {
        let from_pixels = pixel_matrices(blocks, axis, sigma);
        let from_blocks = [0, 1].map(|kind| summed_over_blocks(blocks, axis, &from_pixels[kind]));
        Self { from_pixels, from_blocks }
    }
}

/// Value and derivative (with respect to ln sigma) of a Gaussian of unit sum at the offsets 0, 1, 2, ...
///
/// By Poisson's sum formula the samples sum to 1 up to 2 exp(-2 pi^2 sigma^2): 5e-9 at a width of one pixel, the smallest
/// that is estimated. The tails are not cut: a cut that moves with the width would make the model jump.
fn profile(sigma: f64, length: usize) -> [Vec<f64>; 2] {
    let value = |offset: usize| (-0.5 * (offset as f64 / sigma).powi(2)).exp() / (sigma * TAU.sqrt());
    let slope = |offset: usize| value(offset) * ((offset as f64 / sigma).powi(2) - 1.0);
    [(0..length).map(value).collect(), (0..length).map(slope).collect()]
}

fn pixel_matrices(blocks: &Blocks, axis: usize, sigma: f64) -> [DMatrix<f64>; 2] {
    let (pixels, count) = (blocks.pixels[axis], blocks.count()[axis]);
    profile(sigma, pixels).map(|profile| {
        DMatrix::from_fn(count, pixels, |block, pixel| {
            let receivers = blocks.range(axis, block);
            let number = receivers.len() as f64;
            receivers.map(|receiver| profile[receiver.abs_diff(pixel)]).sum::<f64>() / number
        })
    })
}

fn summed_over_blocks(blocks: &Blocks, axis: usize, from_pixels: &DMatrix<f64>) -> DMatrix<f64> {
    let count = blocks.count()[axis];
    DMatrix::from_fn(count, count, |receiver, source| {
        blocks.range(axis, source).map(|pixel| from_pixels[(receiver, pixel)]).sum()
    })
}
