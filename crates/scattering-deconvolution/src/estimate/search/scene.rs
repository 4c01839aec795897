//! What one frequency of one capture contributes: light that is scattered, and blocks where scattering is observed.

use range_image::{ComplexChannel, ComplexFrame, Flags, Raster};

use crate::estimate::search::response::{INSIDE, OUTSIDE, Share, Source, along};
use crate::estimate::views::blocks::Blocks;
use crate::estimate::views::noise::{Deviations, noise_of_differences};
use crate::estimate::{Capture, ForegroundCapture, TwoPlaneCapture};

/// Values of which nothing may be concluded.
const UNUSABLE: Flags = Flags::SATURATED.union(Flags::NO_DATA).union(Flags::MOTION);
/// Half width of the window from which the light of a source pixel without a value is filled. A choice; a wider window
/// crosses the edge of small objects.
const FILL_REACH: usize = 2;
/// Share of the source's pixels without a value beyond which its light is not known. A choice: scatter of a source that
/// is known to a twentieth is known no better.
const LARGEST_LOSS: f64 = 0.05;
/// Least mean modulus of the source's light, in standard deviations of a pixel. A choice; what dimmer sources scatter
/// drowns in the noise.
const DIMMEST_SOURCE: f64 = 3.0;

/// One observed number: `light · c + drift · g + constant · k` with the scattered light c of its block, the drift g and
/// the constant k, all complex (real part, imaginary part).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::estimate) struct Row {
    pub(in crate::estimate) observed: f64,
    pub(in crate::estimate) light: [f64; 2],
    pub(in crate::estimate) drift: [f64; 2],
    pub(in crate::estimate) constant: [f64; 2],
}

/// The mean of a block: two numbers of a complex difference, or one that is perpendicular to a true phasor.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::estimate) struct BlockMean {
    pub(in crate::estimate) block: [usize; 2],
    pub(in crate::estimate) rows: Vec<Row>,
    /// Standard deviation of each number.
    pub(in crate::estimate) sigma: f64,
}

/// Why a scene says nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::estimate) enum Blind {
    /// There is no light that could be scattered.
    NoLight,
    /// Too much of it has no value: saturated or without data.
    LostLight,
}

/// One frequency of one capture.
#[derive(Debug, Clone)]
pub(in crate::estimate) struct Scene {
    pub(in crate::estimate) capture: usize,
    pub(in crate::estimate) channel: usize,
    pub(in crate::estimate) source: Result<Source, Blind>,
    pub(in crate::estimate) source_pixels: usize,
    pub(in crate::estimate) means: Vec<BlockMean>,
    /// Whether drift has a real part: amplitudes are observed, not phases alone.
    pub(in crate::estimate) sees_amplitude: bool,
}

/// The scenes of a capture; `changed` are the pixels where more than scattering may have changed.
pub(in crate::estimate) fn scenes(
    index: usize,
    capture: &Capture<'_>,
    blocks: Blocks,
    changed: &Raster<bool>,
) -> Vec<Scene> {
    match capture {
        Capture::Foreground(capture) => foreground(index, capture, blocks, changed),
        Capture::TwoPlane(capture) => two_plane(index, capture, blocks, changed),
    }
}

fn foreground(index: usize, capture: &ForegroundCapture<'_>, blocks: Blocks, changed: &Raster<bool>) -> Vec<Scene> {
    let (with, without) = (capture.with_object, capture.without_object);
    let flags = with.flags.as_slice().iter().zip(without.flags.as_slice());
    let usable: Vec<bool> = flags.map(|(a, b)| !(*a | *b).intersects(UNUSABLE)).collect();
    let pairs = with.channels.iter().zip(&without.channels).enumerate();
    let scene = |(channel, (with, without)): (usize, (&ComplexChannel, &ComplexChannel))| {
        let minus = |a: &Raster<f32>, b: &Raster<f32>| -> Vec<f64> {
            a.as_slice().iter().zip(b.as_slice()).map(|(a, b)| f64::from(*a) - f64::from(*b)).collect()
        };
        let mut image = Image {
            blocks,
            real: minus(&with.real, &without.real),
            imaginary: minus(&with.imaginary, &without.imaginary),
            usable: usable.clone(),
        };
        image.mark_unusable();
        let own = changed.as_slice();
        let quiet: Vec<bool> = image.usable.iter().zip(own).map(|(usable, changed)| *usable && !changed).collect();
        let noise = noise_of_differences(&image.real, &quiet, blocks.pixels[0]);
        let deviations = Deviations::new(&[&with.sigma, &without.sigma], noise);
        let observed = |block| {
            let mean = |values: &[f64]| mean_over(values, blocks.pixels_of(block));
            let reference = [&without.real, &without.imaginary].map(|p| mean_of_raster(p, blocks.pixels_of(block)));
            let parts = [mean(&image.real), mean(&image.imaginary)];
            vec![
                Row {
                    observed: parts[0],
                    light: [1.0, 0.0],
                    drift: [reference[0], -reference[1]],
                    constant: [1.0, 0.0],
                },
                Row {
                    observed: parts[1],
                    light: [0.0, 1.0],
                    drift: [reference[1], reference[0]],
                    constant: [0.0, 1.0],
                },
            ]
        };
        let means = image.means(&quiet, &deviations, observed);
        let shares: Vec<Share> = own.iter().map(|changed| if *changed { INSIDE } else { OUTSIDE }).collect();
        let (source, source_pixels) = image.source(&shares, &deviations);
        Scene { capture: index, channel, source, source_pixels, means, sees_amplitude: true }
    };
    pairs.map(scene).collect()
}

fn two_plane(index: usize, capture: &TwoPlaneCapture<'_>, blocks: Blocks, changed: &Raster<bool>) -> Vec<Scene> {
    let frame: &ComplexFrame = capture.observed;
    let usable: Vec<bool> = frame.flags.as_slice().iter().map(|flags| !flags.intersects(UNUSABLE)).collect();
    let scene = |(channel, (observed, truth)): (usize, (&ComplexChannel, &Raster<f32>))| {
        let plane = |raster: &Raster<f32>| -> Vec<f64> { raster.as_slice().iter().map(|v| f64::from(*v)).collect() };
        let (real, imaginary) = (plane(&observed.real), plane(&observed.imaginary));
        let mut image = Image { blocks, real, imaginary, usable: usable.clone() };
        image.mark_unusable();
        let known = truth.as_slice().iter().zip(changed.as_slice()).map(|(phase, out)| phase.is_finite() && !out);
        let quiet: Vec<bool> = image.usable.iter().zip(known).map(|(usable, known)| *usable && known).collect();
        let turned = image.turned_back(truth);
        let noise = noise_of_differences(&turned.1, &quiet, blocks.pixels[0]);
        let deviations = Deviations::new(&[&observed.sigma], noise);
        let directions: (Vec<f64>, Vec<f64>) = truth.as_slice().iter().map(|p| (-f64::from(*p)).sin_cos()).unzip();
        let row = |block| {
            let mean = |values: &[f64]| mean_over(values, blocks.pixels_of(block));
            // Im(c exp(−iφ)), φ averaged as a phasor: c hardly changes within a block.
            let direction = [mean(&directions.0), mean(&directions.1)];
            let drift = [0.0, mean(&turned.0)];
            vec![Row { observed: mean(&turned.1), light: direction, drift, constant: direction }]
        };
        let means = image.means(&quiet, &deviations, row);
        let share = |phase: &f32| if phase.is_finite() { along(f64::from(*phase)) } else { INSIDE };
        let shares: Vec<Share> = truth.as_slice().iter().map(share).collect();
        let (source, source_pixels) = image.source(&shares, &deviations);
        Scene { capture: index, channel, source, source_pixels, means, sees_amplitude: false }
    };
    frame.channels.iter().zip(capture.true_phase).enumerate().map(scene).collect()
}

/// An image whose light is observed and scattered.
struct Image {
    blocks: Blocks,
    real: Vec<f64>,
    imaginary: Vec<f64>,
    usable: Vec<bool>,
}

impl Image {
    /// What is not finite is not usable.
    fn mark_unusable(&mut self) {
        for (usable, (re, im)) in self.usable.iter_mut().zip(self.real.iter().zip(&self.imaginary)) {
            *usable &= re.is_finite() && im.is_finite();
        }
    }

    /// Real and imaginary part of `z exp(-i phase)`.
    fn turned_back(&self, phase: &Raster<f32>) -> (Vec<f64>, Vec<f64>) {
        let parts = self.real.iter().zip(&self.imaginary).zip(phase.as_slice());
        let turn = |((re, im), phase): ((&f64, &f64), &f32)| {
            let (sin, cos) = f64::from(*phase).sin_cos();
            (re * cos + im * sin, im * cos - re * sin)
        };
        parts.map(turn).unzip()
    }

    /// Means of the blocks all pixels of which may be used: of others the model does not know the mean.
    fn means(
        &self,
        quiet: &[bool],
        deviations: &Deviations<'_>,
        rows: impl Fn([usize; 2]) -> Vec<Row>,
    ) -> Vec<BlockMean> {
        let floor = Deviations::floor(&self.real, &self.imaginary, &self.usable);
        let whole = self.blocks.all().filter(|&block| self.blocks.pixels_of(block).all(|pixel| quiet[pixel]));
        let mean = |block| {
            let pixels = self.blocks.pixels_of(block);
            let (variance, count) = pixels.fold((0.0, 0.0), |(v, n), pixel| (v + deviations.variance(pixel), n + 1.0));
            BlockMean { block, rows: rows(block), sigma: (variance.sqrt() / count).max(floor) }
        };
        let finite = |mean: &BlockMean| mean.sigma.is_finite() && mean.rows.iter().all(Row::is_finite);
        whole.map(mean).filter(finite).collect()
    }

    /// The light of the source, and the number of its pixels. Those without a value are filled from their neighbours.
    fn source(&self, shares: &[Share], deviations: &Deviations<'_>) -> (Result<Source, Blind>, usize) {
        let own: Vec<bool> = shares.iter().map(|share| *share != OUTSIDE).collect();
        let count = own.iter().filter(|own| **own).count();
        let lost = own.iter().zip(&self.usable).filter(|(own, usable)| **own && !**usable).count();
        if lost as f64 > LARGEST_LOSS * count as f64 {
            return (Err(Blind::LostLight), count);
        }
        let mut planes = [vec![0.0; own.len()], vec![0.0; own.len()]];
        let (mut light, mut noise) = (0.0, 0.0);
        for pixel in (0..own.len()).filter(|&pixel| own[pixel]) {
            let value =
                if self.usable[pixel] { [self.real[pixel], self.imaginary[pixel]] } else { self.filled(pixel, &own) };
            light += value[0].hypot(value[1]);
            noise += deviations.variance(pixel).sqrt();
            planes.iter_mut().zip(value).for_each(|(plane, value)| plane[pixel] = value);
        }
        let bright = light > 0.0 && (light > DIMMEST_SOURCE * noise || noise.is_nan());
        let source = Source::new(self.blocks, &planes[0], &planes[1], shares).filter(|_| bright);
        (source.ok_or(Blind::NoLight), count)
    }

    /// Mean of the usable neighbours that belong to the source, zero without any.
    fn filled(&self, pixel: usize, own: &[bool]) -> [f64; 2] {
        let [width, height] = self.blocks.pixels;
        let near = |at: usize, length: usize| at.saturating_sub(FILL_REACH)..(at + FILL_REACH + 1).min(length);
        let window = near(pixel / width, height)
            .flat_map(|row| near(pixel % width, width).map(move |col| row * width + col))
            .filter(|&neighbour| own[neighbour] && self.usable[neighbour]);
        let (sum, count) = window.fold(([0.0, 0.0], 0.0), |([re, im], count), neighbour| {
            ([re + self.real[neighbour], im + self.imaginary[neighbour]], count + 1.0)
        });
        if count > 0.0 { sum.map(|sum| sum / count) } else { [0.0, 0.0] }
    }
}

impl Row {
    fn is_finite(&self) -> bool {
        let numbers = [self.light, self.drift, self.constant];
        self.observed.is_finite() && numbers.iter().flatten().all(|value| value.is_finite())
    }
}

fn mean_over(values: &[f64], pixels: impl Iterator<Item = usize>) -> f64 {
    let (sum, count) = pixels.fold((0.0, 0.0), |(sum, count), pixel| (sum + values[pixel], count + 1.0));
    sum / count
}

fn mean_of_raster(values: &Raster<f32>, pixels: impl Iterator<Item = usize>) -> f64 {
    let values = values.as_slice();
    let (sum, count) = pixels.fold((0.0, 0.0), |(sum, count), pixel| (sum + f64::from(values[pixel]), count + 1.0));
    sum / count
}
