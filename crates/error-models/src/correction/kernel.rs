//! Eqs. 14 and 15 in single precision on blocks of pixels, written so that the compiler can vectorise them.
// Only what is inlined is compiled for wide registers; lanes are counted in several planes at once.
#![allow(clippy::inline_always, clippy::needless_range_loop)]

use range_image::ImageFormat;

use crate::RangeErrorModel;
use crate::correction::kernel_further::{PolynomialLanes, Powers, SplineLanes, SurfaceLanes};
use crate::correction::kernel_sines::Sines;
use crate::correction::kernel_tally::LaneTally;
use crate::summary::{AMPLITUDE, DELAY, PATTERN, PERIODIC, POLYNOMIAL};

/// Pixels of a block.
pub(crate) const LANES: usize = 32;

pub(crate) type Lanes = [f32; LANES];
/// All bits where something holds, none elsewhere: as wide as the values that it is laid over.
pub(crate) type Mask = [u32; LANES];

/// Adding and taking off 1.5 * 2^23 rounds a single-precision number below 2^22 to an integer.
pub(crate) const ROUND: f32 = 12_582_912.0;

/// A model with its coefficients in single precision, for one image format.
pub(crate) struct Kernel {
    pub(crate) d0: f64,
    sines: Sines,
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
pub(crate) struct Block<'a> {
    pub(crate) range: &'a mut Lanes,
    pub(crate) sigma: &'a mut Lanes,
    pub(crate) amplitude: &'a Lanes,
    /// `None` where there is no fixed pattern.
    pub(crate) pattern: Option<&'a Lanes>,
}

impl Kernel {
    pub(crate) fn new(model: &RangeErrorModel, format: &ImageFormat, principal_point_mm: [f64; 2]) -> Self {
        let interval = model.ambiguity_interval_m;
        let [low, high] = model.effective_range_span_m();
        let terms = &model.terms;
        let [x, y] = format.image_from_pixel([0.0, 0.0]);
        let first_mm = [x - principal_point_mm[0], y - principal_point_mm[1]];
        let step_mm = [format.pixel_pitch_mm[0], -format.pixel_pitch_mm[1]];
        let further = &model.further;
        Self {
            d0: terms.d0,
            sines: Sines::new(terms, interval),
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
            surface: further.surface.as_ref().map(|surface| SurfaceLanes::new(surface, format, first_mm, step_mm)),
        }
    }

    /// Prepares the parts for one row.
    pub(crate) fn begin_row(&self, row: usize, parts: &mut Parts) {
        if let Some(surface) = &self.surface {
            parts.in_row = surface.of_row(row);
        }
    }

    /// Corrects the pixels of `block`, the first of which is `(column, row)`. Gives all bits for each pixel that the model
    /// does not cover; `None` where it covers all.
    #[inline(always)]
    pub(crate) fn correct<const COUNTS: bool>(
        &self,
        mut block: Block<'_>,
        [column, row]: [usize; 2],
        parts: &mut Parts,
        tally: &mut LaneTally<COUNTS>,
    ) -> Option<Mask> {
        match &self.spline {
            Some(spline) => spline.put(block.range, &mut parts.periodic, &mut parts.derivative),
            None => self.sines.put(block.range, &mut parts.periodic, &mut parts.derivative),
        }
        if let Some(polynomial) = &self.polynomial {
            polynomial.put(block.range, &mut parts.polynomial, &mut parts.derivative);
        }
        self.put_amplitude(block.amplitude, &mut parts.amplitude, &mut parts.known);
        match &self.surface {
            Some(surface) => surface.put(column, row, &parts.in_row, &mut parts.delay, &mut parts.known),
            None => self.put_delay(column, row, &mut parts.delay),
        }
        if let Some(pattern) = block.pattern {
            parts.pattern = *pattern;
        }
        let outside = self.leave_out(block.range, parts, tally);
        self.apply(&mut block, parts, tally);
        tally.add(PERIODIC, &parts.periodic);
        if self.surface.is_none() && outside.is_none() {
            tally.add_line(&parts.delay);
        } else {
            tally.add(DELAY, &parts.delay);
        }
        outside
    }

    /// Sets all parts to zero where the range is outside its span, and counts. Gives the pixels that the model does not
    /// cover, `None` where it covers all.
    #[inline(always)]
    #[allow(clippy::needless_bitwise_bool)] // a branch would keep the loop scalar
    fn leave_out<const COUNTS: bool>(
        &self,
        range: &Lanes,
        parts: &mut Parts,
        tally: &mut LaneTally<COUNTS>,
    ) -> Option<Mask> {
        let mut all = u32::MAX;
        for lane in 0..LANES {
            parts.inside[lane] = mask(within(range[lane], self.range_span));
            all &= parts.inside[lane] & parts.known[lane];
        }
        if all == u32::MAX {
            tally.count_all();
            return None;
        }
        let (mut outside, mut finite) = ([0; LANES], [0; LANES]);
        for lane in 0..LANES {
            finite[lane] = mask(range[lane].abs() <= f32::MAX);
            outside[lane] = finite[lane] & !(parts.inside[lane] & parts.known[lane]);
        }
        tally.count(&finite, &parts.inside, &outside);
        for plane in [
            &mut parts.periodic,
            &mut parts.derivative,
            &mut parts.amplitude,
            &mut parts.delay,
            &mut parts.polynomial,
            &mut parts.pattern,
        ] {
            for (value, inside) in plane.iter_mut().zip(&parts.inside) {
                *value = f32::from_bits(value.to_bits() & inside);
            }
        }
        Some(outside)
    }

    /// Takes the sum of the parts off and transports sigma.
    #[inline(always)]
    fn apply<const COUNTS: bool>(&self, block: &mut Block<'_>, parts: &mut Parts, tally: &mut LaneTally<COUNTS>) {
        let d0 = (self.d0 as f32).to_bits();
        let mut total = [0.0; LANES];
        for lane in 0..LANES {
            total[lane] = f32::from_bits(d0 & parts.inside[lane]) + parts.periodic[lane] + parts.delay[lane];
        }
        for (group, there, plane) in [
            (AMPLITUDE, self.hyperbola.is_some(), &parts.amplitude),
            (PATTERN, block.pattern.is_some(), &parts.pattern),
            (POLYNOMIAL, self.polynomial.is_some(), &parts.polynomial),
        ] {
            if there {
                for (total, part) in total.iter_mut().zip(plane) {
                    *total += part;
                }
                tally.add(group, plane);
            }
        }
        for lane in 0..LANES {
            block.range[lane] -= total[lane];
            block.sigma[lane] *= (1.0 - parts.derivative[lane]).abs();
        }
        tally.add_total(&total);
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
    pattern: Lanes,
    known: Mask,
    /// Whether the range is inside its span: where anything was taken off.
    pub(crate) inside: Mask,
    /// The surface in this row.
    in_row: Powers,
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
            pattern: zeros,
            known: nowhere,
            inside: nowhere,
            in_row: Powers::default(),
        }
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn span_bounds_are_rounded_inwards() {
        let bound = 0.1_f64;
        assert!(f64::from(not_below(bound)) >= bound && f64::from(not_below(bound).next_down()) < bound);
        assert!(f64::from(not_above(bound)) <= bound && f64::from(not_above(bound).next_up()) > bound);
    }
}
