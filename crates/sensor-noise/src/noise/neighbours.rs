//! What neighbouring pixels have in common of the noise of their ranges.

use error_models::{RangeNoise, SharedNoise};
use range_image::{RangeFrame, Raster};
use rayon::prelude::*;
use statistics::Distribution;

use super::ranges::{beside, has_amplitudes};
use super::{Frames, RepeatedRanges};

/// Distances of pixels that are compared, up to this one: windows that ranges are found from (9 pixels of a Kinect) and filters are
/// narrower. What reaches further shows in planes and poses, and counts as one neighbourhood of this width.
const LONGEST: usize = 24;
/// Neighbourhoods from this width on; a narrower one has no second pixel.
const NARROWEST: f64 = 1.5;
/// Widths differ by this.
const STEP: f64 = 0.5;
/// Pairs of successive frames of a station that are taken: sixteen of 176 x 144 pixels tell a share to 0.002.
const MOST_PAIRS: usize = 16;
/// Differences beyond these standard deviations are of edges and of what moved.
const GROSS: f64 = 4.0;
/// Probability that pixels without anything in common are given a share.
const FALSE_ALARM: f64 = 1e-3;

/// What neighbours share of the noise, and the standard deviation of that share; `None` where they have nothing in common.
///
/// Differences of successive frames over their standard deviations have the correlation `share (1 - l / width)` between pixels l
/// columns or rows apart, if neighbourhoods are squares of that width.
pub(super) fn shared_noise<S: Frames<RangeFrame>>(
    stations: &[RepeatedRanges<S>],
    noise: &RangeNoise,
) -> Result<Option<(SharedNoise, f64)>, S::Error> {
    let mut all = [Products::default(); LONGEST];
    for station in stations {
        let (mut before, mut pairs) = (None::<Raster<f32>>, 0);
        station.each(&mut |frame| {
            if let Some(before) = before.as_ref().filter(|_| pairs < MOST_PAIRS) {
                let differences = differences(before, frame, noise, station.interval_m);
                of_image(&differences).iter().zip(&mut all).for_each(|(one, sum)| sum.add(one));
                pairs += 1;
            }
            before = (pairs < MOST_PAIRS).then(|| frame.range.clone());
            Ok(())
        })?;
    }
    Ok(fitted(&all))
}

/// Differences to the frame before, over their standard deviations and less their mean; NaN where there is none.
fn differences(before: &Raster<f32>, frame: &RangeFrame, noise: &RangeNoise, interval_m: Option<f64>) -> Raster<f32> {
    let has_amplitudes = has_amplitudes(frame);
    let (width, height) = (frame.range.width(), frame.range.height());
    let mut all = Raster::from_fn(width, height, |col, row| {
        let at = row * width + col;
        let [from, to] = [before, &frame.range].map(|ranges| f64::from(ranges.as_slice()[at]));
        let amplitude = if has_amplitudes { f64::from(frame.amplitude.as_slice()[at]) } else { f64::NAN };
        let sigma = std::f64::consts::SQRT_2 * noise.sigma_m(amplitude, to);
        let difference = (beside(to, from, interval_m) - from) / sigma;
        let is_usable = difference.abs() < GROSS && frame.flags.as_slice()[at].is_empty();
        if is_usable { difference as f32 } else { f32::NAN }
    });
    let known = || all.as_slice().iter().filter(|value| value.is_finite());
    let mean = known().map(|value| f64::from(*value)).sum::<f64>() / known().count().max(1) as f64;
    all.as_mut_slice().iter_mut().for_each(|value| *value -= mean as f32);
    all
}

/// Sums over pairs of pixels at one distance.
#[derive(Debug, Clone, Copy, Default)]
struct Products {
    pairs: f64,
    product: f64,
    squares: f64,
}

impl Products {
    fn add(&mut self, other: &Self) {
        self.pairs += other.pairs;
        self.product += other.product;
        self.squares += other.squares;
    }

    fn take(&mut self, first: f32, second: f32) {
        let (first, second) = (f64::from(first), f64::from(second));
        if first.is_finite() && second.is_finite() {
            self.pairs += 1.0;
            self.product += first * second;
            self.squares += 0.5 * (first * first + second * second);
        }
    }

    fn correlation(&self) -> f64 {
        if self.squares > 0.0 { self.product / self.squares } else { 0.0 }
    }
}

/// Sums of an image, along rows and columns; row by row, whatever the number of threads.
fn of_image(image: &Raster<f32>) -> [Products; LONGEST] {
    let rows: Vec<&[f32]> = image.rows().collect();
    let of_row = |row: usize| {
        let mut all = [Products::default(); LONGEST];
        for (index, sum) in all.iter_mut().enumerate() {
            let (own, apart) = (rows[row], index + 1);
            own.iter().zip(own.iter().skip(apart)).for_each(|(a, b)| sum.take(*a, *b));
            if let Some(below) = rows.get(row + apart) {
                own.iter().zip(*below).for_each(|(a, b)| sum.take(*a, *b));
            }
        }
        all
    };
    let by_row: Vec<[Products; LONGEST]> = (0..rows.len()).into_par_iter().map(of_row).collect();
    let mut all = [Products::default(); LONGEST];
    for row in &by_row {
        row.iter().zip(&mut all).for_each(|(one, sum)| sum.add(one));
    }
    all
}

/// The width and share that fit best, and the share's deviation, where the share is no chance.
fn fitted(sums: &[Products; LONGEST]) -> Option<(SharedNoise, f64)> {
    let widths = ((LONGEST as f64 - NARROWEST) / STEP).round() as usize + 1;
    let fit = |index: usize| {
        let width_px = NARROWEST + STEP * index as f64;
        let weight = |index: usize| (1.0 - (index + 1) as f64 / width_px).max(0.0);
        let normal: f64 = sums.iter().enumerate().map(|(k, sum)| sum.pairs * weight(k).powi(2)).sum();
        let right: f64 = sums.iter().enumerate().map(|(k, sum)| sum.pairs * weight(k) * sum.correlation()).sum();
        let share = (right / normal).clamp(0.0, 1.0);
        let misfit = |(k, sum): (usize, &Products)| sum.pairs * (sum.correlation() - share * weight(k)).powi(2);
        let misfit: f64 = sums.iter().enumerate().map(misfit).sum();
        (misfit, SharedNoise { share, width_px }, normal.sqrt().recip())
    };
    let (_, shared, sigma) = (0..widths).map(fit).min_by(|a, b| a.0.total_cmp(&b.0))?;
    let chance = widths as f64 * Distribution::Normal.survival(shared.share / sigma);
    // Bartlett: products of neighbours that belong together vary together, as many as their squared correlations over the image.
    let alike = 1.0 + (shared.share * 2.0 * shared.width_px / 3.0).powi(2);
    (chance < FALSE_ALARM).then_some((shared, sigma * alike.sqrt()))
}
