//! Spline, polynomial and surface in single precision on blocks of pixels.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use range_image::ImageFormat;

use crate::correction::kernel::{LANES, Lanes, Mask, ROUND};
use crate::models::legendre::{Legendre, powers};
use crate::surface::EDGE;
use crate::{ImageSurface, PeriodicSpline, RangePolynomial};

/// Positions that a byte can tell: an index that needs no check.
const PIECES: usize = 256;

/// The cubic of each piece of a spline.
pub(crate) struct SplineLanes {
    pieces: [[f32; 4]; PIECES],
    inverse_interval: f32,
    knots: f32,
    knots_per_m: f32,
}

impl SplineLanes {
    pub(crate) fn new(spline: &PeriodicSpline, ambiguity_interval_m: f64) -> Self {
        let mut pieces = [[0.0; 4]; PIECES];
        for (piece, cubic) in pieces.iter_mut().zip(spline.pieces()) {
            *piece = cubic.map(|coefficient| coefficient as f32);
        }
        let knots = spline.knots() as f64;
        Self {
            pieces,
            inverse_interval: (1.0 / ambiguity_interval_m) as f32,
            knots: knots as f32,
            knots_per_m: (knots / ambiguity_interval_m) as f32,
        }
    }

    /// Values and derivatives with respect to the range.
    #[inline(always)]
    pub(crate) fn put(&self, range: &Lanes, value: &mut Lanes, derivative: &mut Lanes) {
        let (mut index, mut within) = ([0_u8; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let intervals = range[lane] * self.inverse_interval;
            let phase = intervals - ((intervals + ROUND) - ROUND);
            let position = if phase < 0.0 { phase + 1.0 } else { phase } * self.knots;
            // The end of the interval, where rounding leads to, belongs to its last piece.
            let knot = position.min(self.knots - 1.0) as u8;
            index[lane] = knot;
            within[lane] = position - f32::from(knot);
        }
        // Copied first and then read across: the compiler can vectorise that.
        let mut cubics = [[0.0; 4]; LANES];
        for (cubic, index) in cubics.iter_mut().zip(index) {
            *cubic = self.pieces[usize::from(index)];
        }
        for lane in 0..LANES {
            let [a, b, c, d] = cubics[lane];
            let u = within[lane];
            value[lane] = a + u * (b + u * (c + u * d));
            derivative[lane] = (b + u * (2.0 * c + u * (3.0 * d))) * self.knots_per_m;
        }
    }
}

/// A polynomial in powers of a number from -1 to 1.
pub(crate) struct PolynomialLanes {
    powers: Powers,
    middle: f32,
    inverse_half: f32,
}

impl PolynomialLanes {
    pub(crate) fn new(polynomial: &RangePolynomial) -> Self {
        let [low, high] = polynomial.range_span_m;
        let mut by_order = [0.0; ORDERS];
        for (place, q) in by_order[1..].iter_mut().zip(&polynomial.coefficients) {
            *place = *q;
        }
        let powers = Powers::of_series(&by_order);
        Self { powers, middle: f64::midpoint(low, high) as f32, inverse_half: (2.0 / (high - low)) as f32 }
    }

    /// Puts the values and adds the derivatives with respect to the range; both without meaning outside the span.
    #[inline(always)]
    pub(crate) fn put(&self, range: &Lanes, value: &mut Lanes, derivative: &mut Lanes) {
        let mut t = [0.0; LANES];
        for (t, range) in t.iter_mut().zip(range) {
            *t = ((range - self.middle) * self.inverse_half).clamp(-1.0, 1.0);
        }
        let mut slope = [0.0; LANES];
        if self.powers.is_low() {
            put_powers::<LOW>(&self.powers, &t, value, &mut slope);
        } else {
            put_powers::<ORDERS>(&self.powers, &t, value, &mut slope);
        }
        for (derivative, slope) in derivative.iter_mut().zip(slope) {
            *derivative += slope * self.inverse_half;
        }
    }
}

/// A surface over the image of one format.
pub(crate) struct SurfaceLanes {
    /// By order in x and order in y.
    coefficients: [[f64; ORDERS]; ORDERS],
    /// Reduced coordinate of the first column and its step, of the first row and its step.
    columns: [f64; 2],
    rows: [f64; 2],
    /// First column inside the span, and the first one behind it.
    inside: [usize; 2],
}

impl SurfaceLanes {
    /// `first_mm` is the first pixel's image point from the principal point, `step_mm` the way to the next column and row.
    pub(crate) fn new(surface: &ImageSurface, format: &ImageFormat, first_mm: [f64; 2], step_mm: [f64; 2]) -> Self {
        let line = |[low, high]: [f64; 2], first: f64, step: f64| {
            [(2.0 * first - low - high) / (high - low), 2.0 * step / (high - low)]
        };
        let mut coefficients = [[0.0; ORDERS]; ORDERS];
        for ([i, j], g) in surface.exponents().zip(&surface.coefficients) {
            coefficients[i][j] = *g;
        }
        let columns = line(surface.x_span_mm, first_mm[0], step_mm[0]);
        let in_span = |column: &usize| (columns[0] + *column as f64 * columns[1]).abs() <= 1.0 + EDGE;
        let first = (0..format.width).find(in_span).unwrap_or(format.width);
        let behind = (0..format.width).rfind(in_span).map_or(first, |last| last + 1);
        let rows = line(surface.y_span_mm, first_mm[1], step_mm[1]);
        Self { coefficients, columns, rows, inside: [first, behind] }
    }

    /// Values of the block that begins at `(column, row)`; pixels outside the spans are no longer `known`.
    #[inline(always)]
    pub(crate) fn put(&self, column: usize, row: usize, in_row: &Powers, value: &mut Lanes, known: &mut Mask) {
        let first = (self.columns[0] + column as f64 * self.columns[1]) as f32;
        let step = self.columns[1] as f32;
        let mut t = [0.0; LANES];
        for (lane, t) in t.iter_mut().enumerate() {
            *t = (first + lane as f32 * step).clamp(-1.0, 1.0);
        }
        if in_row.is_low() {
            put_values::<LOW>(in_row, &t, value);
        } else {
            put_values::<SURFACE_ORDERS>(in_row, &t, value);
        }
        let [inside, behind] = self.inside;
        if column >= inside && column + LANES <= behind && self.holds_row(row) {
            return;
        }
        for (lane, known) in known.iter_mut().enumerate() {
            let holds = (inside..behind).contains(&(column + lane)) && self.holds_row(row);
            *known &= u32::from(holds).wrapping_neg();
        }
    }

    fn holds_row(&self, row: usize) -> bool {
        (self.rows[0] + row as f64 * self.rows[1]).abs() <= 1.0 + EDGE
    }

    /// What is left of the surface in one row: a polynomial in x.
    pub(crate) fn of_row(&self, row: usize) -> Powers {
        let y = Legendre::on_span([-1.0, 1.0], self.rows[0] + row as f64 * self.rows[1]);
        Powers::of_series(&self.coefficients.map(|of_y| of_y.iter().zip(y.value).map(|(g, value)| g * value).sum()))
    }
}

/// Orders that a series may have, zero among them.
const ORDERS: usize = crate::models::legendre::MOST_ORDER + 1;

/// Orders that a surface may have, zero among them.
const SURFACE_ORDERS: usize = ImageSurface::ORDERS[1] + 1;

/// Orders of most polynomials in use, which take half of the time.
const LOW: usize = 5;

/// A series of Legendre polynomials multiplied out. The coefficients of order 8 add up to 300 times those of the series:
/// their roundings, of 1e-7 and less, stay below 2e-5 of it.
#[derive(Default)]
pub(crate) struct Powers([f32; ORDERS]);

impl Powers {
    fn of_series(by_order: &[f64; ORDERS]) -> Self {
        Self(powers(by_order).map(|power| power as f32))
    }

    fn is_low(&self) -> bool {
        self.0[LOW..].iter().all(|power| power.to_bits() == 0)
    }
}

/// Horner's rule for values and derivatives, of `N` orders.
#[inline(always)]
fn put_powers<const N: usize>(powers: &Powers, t: &Lanes, value: &mut Lanes, slope: &mut Lanes) {
    for lane in 0..LANES {
        let (mut sum, mut derivative) = (0.0, 0.0);
        for order in (0..N).rev() {
            derivative = derivative * t[lane] + sum;
            sum = sum * t[lane] + powers.0[order];
        }
        (value[lane], slope[lane]) = (sum, derivative);
    }
}

/// The values alone, of `N` orders.
#[inline(always)]
fn put_values<const N: usize>(powers: &Powers, t: &Lanes, value: &mut Lanes) {
    for lane in 0..LANES {
        value[lane] = (0..N).rev().fold(0.0, |sum, order| sum * t[lane] + powers.0[order]);
    }
}
