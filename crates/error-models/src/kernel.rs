//! Eqs. 14 and 15 in single precision on blocks of pixels, written so that the compiler can vectorise them.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use std::f32::consts::PI;

use range_image::{Flags, ImageFormat};

use crate::RangeErrorModel;
use crate::kernel_further::{PolynomialLanes, SplineLanes, SurfaceLanes};
use crate::summary::{AMPLITUDE, DELAY, GROUPS, PATTERN, PERIODIC, POLYNOMIAL, TOTAL, Tally};

/// Pixels of a block.
pub(crate) const LANES: usize = 32;

pub(crate) type Lanes = [f32; LANES];
pub(crate) type Mask = [bool; LANES];

/// Adding and taking off 1.5 * 2^23 rounds a single-precision number below 2^22 to an integer.
pub(crate) const ROUND: f32 = 12_582_912.0;

/// A model with its coefficients in single precision, for one image format.
pub(crate) struct Kernel {
    inverse_interval: f32,
    wave_number: [f32; 3],
    d0: f32,
    periodic: [f32; 6],
    delay_per_column: f32,
    delay_per_row: f64,
    delay_of_first: f64,
    range_span: [f32; 2],
    hyperbola: Option<HyperbolaRatios>,
    spline: Option<SplineLanes>,
    polynomial: Option<PolynomialLanes>,
    surface: Option<SurfaceLanes>,
}

/// The quotients that Eq. 15 consists of.
struct HyperbolaRatios {
    linear: f32,
    slope: f32,
    constant: f32,
    span: [f32; 2],
}

/// The pixels of one block; lanes without a pixel hold a NaN range.
pub(crate) struct Block {
    pub(crate) range: Lanes,
    pub(crate) sigma: Lanes,
    pub(crate) amplitude: Lanes,
    pub(crate) pattern: Lanes,
    pub(crate) flags: [Flags; LANES],
}

impl Block {
    #[inline(always)]
    pub(crate) fn empty() -> Self {
        Self {
            range: [f32::NAN; LANES],
            sigma: [f32::NAN; LANES],
            amplitude: [f32::NAN; LANES],
            pattern: [0.0; LANES],
            flags: [Flags::empty(); LANES],
        }
    }
}

impl Kernel {
    pub(crate) fn new(model: &RangeErrorModel, format: &ImageFormat, principal_point_mm: [f64; 2]) -> Self {
        let interval = model.ambiguity_interval_m;
        let base = (2.0 * std::f64::consts::PI / interval) as f32;
        let [low, high] = model.effective_range_span_m();
        let terms = &model.terms;
        let [x, y] = format.image_from_pixel([0.0, 0.0]);
        let first_mm = [x - principal_point_mm[0], y - principal_point_mm[1]];
        let step_mm = [format.pixel_pitch_mm[0], -format.pixel_pitch_mm[1]];
        let further = &model.further;
        Self {
            inverse_interval: (1.0 / interval) as f32,
            wave_number: [base, 2.0 * base, 4.0 * base],
            d0: terms.d0 as f32,
            periodic: terms.periodic.map(|d| d as f32),
            delay_per_column: (terms.e1 * step_mm[0]) as f32,
            delay_per_row: terms.e2 * step_mm[1],
            delay_of_first: terms.delay(first_mm[0], first_mm[1]),
            range_span: [not_below(low), not_above(high)],
            hyperbola: model.hyperbola.map(|h| HyperbolaRatios {
                linear: (h.h2 / h.h3) as f32,
                slope: (-2.0 * h.h1 / h.h3) as f32,
                constant: (1.0 / h.h3) as f32,
                span: [not_below(h.amplitude_span[0]), not_above(h.amplitude_span[1])],
            }),
            spline: further.spline.as_ref().map(|spline| SplineLanes::new(spline, interval)),
            polynomial: further.polynomial.as_ref().map(PolynomialLanes::new),
            surface: further.surface.as_ref().map(|surface| SurfaceLanes::new(surface, first_mm, step_mm)),
        }
    }

    /// Corrects the pixels of `block`, the first of which is `(column, row)`.
    #[inline(always)]
    pub(crate) fn correct(&self, block: &mut Block, column: usize, row: usize, tally: &mut LaneTally) {
        let (periodic, mut derivative) = match &self.spline {
            Some(spline) => spline.at(&block.range),
            None => self.periodic(&block.range),
        };
        let (amplitude, mut known) = self.amplitude(&block.amplitude);
        let delay = match &self.surface {
            Some(surface) => {
                let (value, in_span) = surface.at(column, row);
                known = std::array::from_fn(|lane| known[lane] & in_span[lane]);
                value
            }
            None => self.delay(column, row),
        };
        // What a polynomial adds goes with the amplitude's part as long as all of it is added up.
        let mut others: Lanes = std::array::from_fn(|lane| amplitude[lane] + block.pattern[lane]);
        let polynomial = self.polynomial.as_ref().map(|polynomial| polynomial.at(&block.range));
        if let Some((value, slope)) = &polynomial {
            others = std::array::from_fn(|lane| others[lane] + value[lane]);
            derivative = std::array::from_fn(|lane| derivative[lane] + slope[lane]);
        }
        let finite = block.range.map(|range| range.abs() <= f32::MAX);
        let inside = block.range.map(|range| within(range, self.range_span));
        #[allow(clippy::needless_bitwise_bool)] // a branch would keep the loop scalar
        let outside: Mask = std::array::from_fn(|lane| finite[lane] & !(inside[lane] & known[lane]));
        let total: Lanes = std::array::from_fn(|lane| self.d0 + periodic[lane] + delay[lane] + others[lane]);
        let (range, sigma) = (block.range, block.sigma);
        block.range = std::array::from_fn(|lane| if inside[lane] { range[lane] - total[lane] } else { range[lane] });
        block.sigma = std::array::from_fn(|lane| {
            let transported = sigma[lane] * (1.0 - derivative[lane]).abs();
            if inside[lane] { transported } else { sigma[lane] }
        });
        for (flags, outside) in block.flags.iter_mut().zip(outside) {
            *flags = Flags::from_bits_retain(flags.bits() | (u16::from(outside) * Flags::OUTSIDE_SPAN.bits()));
        }
        tally.count(&finite, &inside, &outside);
        tally.add(TOTAL, &total, &inside);
        tally.add(PERIODIC, &periodic, &inside);
        tally.add(DELAY, &delay, &inside);
        tally.add(AMPLITUDE, &amplitude, &inside);
        tally.add(PATTERN, &block.pattern, &inside);
        if let Some((value, _)) = &polynomial {
            tally.add(POLYNOMIAL, value, &inside);
        }
    }

    /// The signal propagation delay of the block that begins at `(column, row)`.
    #[inline(always)]
    fn delay(&self, column: usize, row: usize) -> Lanes {
        let of_row = self.delay_of_first + row as f64 * self.delay_per_row;
        let first = (of_row + column as f64 * f64::from(self.delay_per_column)) as f32;
        std::array::from_fn(|lane| first + lane as f32 * self.delay_per_column)
    }

    /// The periodic terms and their derivative: one sine and cosine at half the longest wave's angle, doubled
    /// three times.
    #[inline(always)]
    fn periodic(&self, range: &Lanes) -> (Lanes, Lanes) {
        let [d2, d3, d4, d5, d6, d7] = self.periodic;
        let [k1, k2, k3] = self.wave_number;
        let (mut value, mut derivative) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let intervals = range[lane] * self.inverse_interval;
            let half_angle = PI * (intervals - ((intervals + ROUND) - ROUND));
            let first = octave(sin_cos_of_right_angles(half_angle));
            let second = octave(first);
            let third = octave(second);
            value[lane] =
                (d2 * first.0 + d3 * first.1) + (d4 * second.0 + d5 * second.1) + (d6 * third.0 + d7 * third.1);
            derivative[lane] = k1 * (d2 * first.1 - d3 * first.0)
                + k2 * (d4 * second.1 - d5 * second.0)
                + k3 * (d6 * third.1 - d7 * third.0);
        }
        (value, derivative)
    }

    /// Eq. 15, zero where it does not hold, and whether it holds; without a hyperbola it holds everywhere.
    #[inline(always)]
    fn amplitude(&self, amplitude: &Lanes) -> (Lanes, Mask) {
        let (mut value, mut known) = ([0.0; LANES], [true; LANES]);
        let Some(ratios) = &self.hyperbola else { return (value, known) };
        for lane in 0..LANES {
            let a = amplitude[lane];
            let linear = ratios.linear * a;
            let rest = ratios.constant + ratios.slope * a;
            let radicand = linear * linear + rest;
            let root = radicand.sqrt();
            // Either way the two parts that are added have one sign.
            let stable = rest / (linear.abs() + root);
            let branch = if linear > 0.0 { stable } else { root - linear };
            known[lane] = within(a, ratios.span) & within(radicand, [0.0, f32::MAX]);
            value[lane] = if known[lane] { branch } else { 0.0 };
        }
        (value, known)
    }
}

/// Sine and cosine of an angle in [-pi/2, pi/2] by their Taylor series; the next terms are below 6e-8, the
/// resolution of single precision.
#[inline(always)]
fn sin_cos_of_right_angles(angle: f32) -> (f32, f32) {
    let square = angle * angle;
    let sin = 1.0 / 362_880.0 - square * (1.0 / 39_916_800.0);
    let sin = 1.0 / 120.0 - square * (1.0 / 5_040.0 - square * sin);
    let sin = angle * (1.0 - square * (1.0 / 6.0 - square * sin));
    let cos = 1.0 / 40_320.0 - square * (1.0 / 3_628_800.0 - square * (1.0 / 479_001_600.0));
    let cos = 1.0 / 24.0 - square * (1.0 / 720.0 - square * cos);
    let cos = 1.0 - square * (0.5 - square * cos);
    (sin, cos)
}

/// Sine and cosine of the doubled angle.
#[inline(always)]
fn octave((sin, cos): (f32, f32)) -> (f32, f32) {
    (2.0 * sin * cos, (cos - sin) * (cos + sin))
}

/// Whether a value lies in a span, bounds included; NaN lies in none.
#[allow(clippy::needless_bitwise_bool)] // a branch would keep the loop around it scalar
#[inline(always)]
fn within(value: f32, [low, high]: [f32; 2]) -> bool {
    (value >= low) & (value <= high)
}

/// The smallest single-precision number that is not below `bound`.
fn not_below(bound: f64) -> f32 {
    let nearest = bound as f32;
    if f64::from(nearest) < bound { nearest.next_up() } else { nearest }
}

/// The largest single-precision number that is not above `bound`.
fn not_above(bound: f64) -> f32 {
    let nearest = bound as f32;
    if f64::from(nearest) > bound { nearest.next_down() } else { nearest }
}

/// Counts and sums of a row, lane by lane.
pub(crate) struct LaneTally {
    finite: [u32; LANES],
    corrected: [u32; LANES],
    outside_span: [u32; LANES],
    sum: [Lanes; GROUPS],
    largest: [Lanes; GROUPS],
}

impl LaneTally {
    pub(crate) fn new() -> Self {
        Self {
            finite: [0; LANES],
            corrected: [0; LANES],
            outside_span: [0; LANES],
            sum: [[0.0; LANES]; GROUPS],
            largest: [[0.0; LANES]; GROUPS],
        }
    }

    #[inline(always)]
    fn count(&mut self, finite: &Mask, corrected: &Mask, outside_span: &Mask) {
        for lane in 0..LANES {
            self.finite[lane] += u32::from(finite[lane]);
            self.corrected[lane] += u32::from(corrected[lane]);
            self.outside_span[lane] += u32::from(outside_span[lane]);
        }
    }

    /// Adds one group of `Δρ` of the pixels that were corrected.
    #[inline(always)]
    fn add(&mut self, group: usize, correction: &Lanes, corrected: &Mask) {
        let (sum, largest) = (&mut self.sum[group], &mut self.largest[group]);
        for lane in 0..LANES {
            let value = if corrected[lane] { correction[lane] } else { 0.0 };
            sum[lane] += value;
            largest[lane] = if value.abs() > largest[lane] { value.abs() } else { largest[lane] };
        }
    }

    /// Adds the lanes up in their order.
    pub(crate) fn total(&self) -> Tally {
        let count = |lanes: &[u32; LANES]| lanes.iter().map(|lane| *lane as usize).sum();
        Tally {
            finite: count(&self.finite),
            corrected: count(&self.corrected),
            outside_span: count(&self.outside_span),
            sum: self.sum.map(|lanes| lanes.iter().map(|lane| f64::from(*lane)).sum()),
            largest: self.largest.map(|lanes| f64::from(lanes.iter().copied().fold(0.0, f32::max))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_are_good_to_single_precision() {
        for step in -1000..=1000 {
            let angle = f64::from(step) / 1000.0 * std::f64::consts::FRAC_PI_2;
            let (sin, cos) = sin_cos_of_right_angles(angle as f32);
            // Two units in the last place of 1, and the first term left out (5.7e-8).
            let tolerance = 3e-7;
            assert!((f64::from(sin) - angle.sin()).abs() < tolerance, "sin {angle}");
            assert!((f64::from(cos) - angle.cos()).abs() < tolerance, "cos {angle}");
        }
    }

    #[test]
    fn span_bounds_are_rounded_inwards() {
        let bound = 0.1_f64;
        assert!(f64::from(not_below(bound)) >= bound && f64::from(not_below(bound).next_down()) < bound);
        assert!(f64::from(not_above(bound)) <= bound && f64::from(not_above(bound).next_up()) > bound);
    }
}
