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
/// All bits where something holds, none elsewhere: as wide as the values that it is laid over.
pub(crate) type Mask = [u32; LANES];

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
    pub(crate) has_pattern: bool,
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
            has_pattern: false,
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
    pub(crate) fn correct(
        &self,
        block: &mut Block,
        [column, row]: [usize; 2],
        parts: &mut Parts,
        tally: &mut LaneTally,
    ) {
        match &self.spline {
            Some(spline) => spline.put(&block.range, &mut parts.periodic, &mut parts.derivative),
            None => self.put_periodic(&block.range, &mut parts.periodic, &mut parts.derivative),
        }
        self.put_amplitude(&block.amplitude, &mut parts.amplitude, &mut parts.known);
        match &self.surface {
            Some(surface) => surface.put(column, row, &mut parts.delay, &mut parts.known),
            None => self.put_delay(column, row, &mut parts.delay),
        }
        // What a polynomial adds goes with the amplitude's part as long as all of it is added up.
        for lane in 0..LANES {
            parts.others[lane] = parts.amplitude[lane] + block.pattern[lane];
        }
        if let Some(polynomial) = &self.polynomial {
            let mut slope = [0.0; LANES];
            polynomial.put(&block.range, &mut parts.polynomial, &mut slope);
            for (lane, slope) in slope.into_iter().enumerate() {
                parts.others[lane] += parts.polynomial[lane];
                parts.derivative[lane] += slope;
            }
        }
        self.apply(block, parts, tally);
        tally.add(PERIODIC, &parts.periodic, &parts.inside);
        tally.add(DELAY, &parts.delay, &parts.inside);
        if self.hyperbola.is_some() {
            tally.add(AMPLITUDE, &parts.amplitude, &parts.inside);
        }
        if block.has_pattern {
            tally.add(PATTERN, &block.pattern, &parts.inside);
        }
        if self.polynomial.is_some() {
            tally.add(POLYNOMIAL, &parts.polynomial, &parts.inside);
        }
    }

    /// Takes the sum of the parts off, transports sigma, flags what the model does not cover, and counts.
    #[inline(always)]
    #[allow(clippy::needless_bitwise_bool)] // a branch would keep the loop scalar
    fn apply(&self, block: &mut Block, parts: &mut Parts, tally: &mut LaneTally) {
        let mut total = [0.0; LANES];
        for (lane, total) in total.iter_mut().enumerate() {
            let (range, sigma) = (block.range[lane], block.sigma[lane]);
            let inside = within(range, self.range_span);
            let finite = range.abs() <= f32::MAX;
            let (inside_mask, finite_mask) = (mask(inside), mask(finite));
            let outside_mask = finite_mask & !(inside_mask & parts.known[lane]);
            *total = self.d0 + parts.periodic[lane] + parts.delay[lane] + parts.others[lane];
            let transported = sigma * (1.0 - parts.derivative[lane]).abs();
            block.range[lane] = if inside { range - *total } else { range };
            block.sigma[lane] = if inside { transported } else { sigma };
            parts.inside[lane] = inside_mask;
            parts.outside[lane] = outside_mask;
            parts.finite[lane] = finite_mask;
        }
        for (flags, outside) in block.flags.iter_mut().zip(&parts.outside) {
            *flags = Flags::from_bits_retain(flags.bits() | (*outside as u16 & Flags::OUTSIDE_SPAN.bits()));
        }
        tally.count(&parts.finite, &parts.inside, &parts.outside);
        tally.add(TOTAL, &total, &parts.inside);
    }

    /// The signal propagation delay of the block that begins at `(column, row)`.
    #[inline(always)]
    fn put_delay(&self, column: usize, row: usize, delay: &mut Lanes) {
        let of_row = self.delay_of_first + row as f64 * self.delay_per_row;
        let first = (of_row + column as f64 * f64::from(self.delay_per_column)) as f32;
        for (lane, delay) in delay.iter_mut().enumerate() {
            *delay = first + lane as f32 * self.delay_per_column;
        }
    }

    /// The periodic terms and their derivative: one sine and cosine at half the longest wave's angle, doubled
    /// three times.
    #[inline(always)]
    fn put_periodic(&self, range: &Lanes, value: &mut Lanes, derivative: &mut Lanes) {
        let [d2, d3, d4, d5, d6, d7] = self.periodic;
        let [k1, k2, k3] = self.wave_number;
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
    }

    /// Eq. 15, zero where it does not hold, and whether it holds; without a hyperbola it holds everywhere.
    #[inline(always)]
    #[allow(clippy::needless_bitwise_bool)] // a branch would keep the loop scalar
    fn put_amplitude(&self, amplitude: &Lanes, value: &mut Lanes, known: &mut Mask) {
        known.fill(u32::MAX);
        let Some(ratios) = &self.hyperbola else { return };
        for lane in 0..LANES {
            let a = amplitude[lane];
            let linear = ratios.linear * a;
            let rest = ratios.constant + ratios.slope * a;
            let radicand = linear * linear + rest;
            let root = radicand.sqrt();
            // Either way the two parts that are added have one sign.
            let stable = rest / (linear.abs() + root);
            let branch = if linear > 0.0 { stable } else { root - linear };
            let holds = within(a, ratios.span) & within(radicand, [0.0, f32::MAX]);
            known[lane] = mask(holds);
            value[lane] = if holds { branch } else { 0.0 };
        }
    }
}

/// The parts of a correction, metre, and where they apply. Parts that a model does not have stay zero, from block to block.
pub(crate) struct Parts {
    periodic: Lanes,
    derivative: Lanes,
    amplitude: Lanes,
    delay: Lanes,
    polynomial: Lanes,
    others: Lanes,
    known: Mask,
    finite: Mask,
    inside: Mask,
    outside: Mask,
}

impl Default for Parts {
    #[inline(always)]
    fn default() -> Self {
        let (zeros, nowhere) = ([0.0; LANES], [0; LANES]);
        Self {
            periodic: zeros,
            derivative: zeros,
            amplitude: zeros,
            delay: zeros,
            polynomial: zeros,
            others: zeros,
            known: nowhere,
            finite: nowhere,
            inside: nowhere,
            outside: nowhere,
        }
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

/// All bits or none.
#[inline(always)]
fn mask(holds: bool) -> u32 {
    u32::from(holds).wrapping_neg()
}

/// Sums that are kept beside each other: so few stay in registers.
const SUMS: usize = 8;

/// Counts and sums of a row.
pub(crate) struct LaneTally {
    /// Minus the number of pixels: what the sum of their masks is.
    finite: [u32; SUMS],
    corrected: [u32; SUMS],
    outside_span: [u32; SUMS],
    sum: [[f32; SUMS]; GROUPS],
    /// Bits of the largest absolute value, which grow with it.
    largest: [[u32; SUMS]; GROUPS],
}

impl LaneTally {
    pub(crate) fn new() -> Self {
        Self {
            finite: [0; SUMS],
            corrected: [0; SUMS],
            outside_span: [0; SUMS],
            sum: [[0.0; SUMS]; GROUPS],
            largest: [[0; SUMS]; GROUPS],
        }
    }

    #[inline(always)]
    fn count(&mut self, finite: &Mask, corrected: &Mask, outside_span: &Mask) {
        let counts = [&mut self.finite, &mut self.corrected, &mut self.outside_span];
        for (count, masks) in counts.into_iter().zip([finite, corrected, outside_span]) {
            for masks in masks.as_chunks::<SUMS>().0 {
                for lane in 0..SUMS {
                    count[lane] = count[lane].wrapping_add(masks[lane]);
                }
            }
        }
    }

    /// Adds one group of `Δρ` of the pixels that were corrected.
    #[inline(always)]
    fn add(&mut self, group: usize, correction: &Lanes, corrected: &Mask) {
        let (sum, largest) = (&mut self.sum[group], &mut self.largest[group]);
        for (values, masks) in correction.as_chunks::<SUMS>().0.iter().zip(corrected.as_chunks::<SUMS>().0) {
            for lane in 0..SUMS {
                let bits = values[lane].to_bits() & masks[lane];
                sum[lane] += f32::from_bits(bits);
                largest[lane] = largest[lane].max(bits & (u32::MAX >> 1));
            }
        }
    }

    /// Adds the lanes up in their order.
    pub(crate) fn total(&self) -> Tally {
        let count = |lanes: &[u32; SUMS]| lanes.iter().map(|lane| lane.wrapping_neg() as usize).sum();
        let largest = |lanes: [u32; SUMS]| f64::from(f32::from_bits(lanes.into_iter().max().unwrap_or(0)));
        Tally {
            finite: count(&self.finite),
            corrected: count(&self.corrected),
            outside_span: count(&self.outside_span),
            sum: self.sum.map(|lanes| lanes.iter().map(|lane| f64::from(*lane)).sum()),
            largest: self.largest.map(largest),
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
