//! Spline, polynomial and surface in single precision on blocks of pixels.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use crate::kernel::{LANES, Lanes, Mask, ROUND};
use crate::legendre::Legendre;
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
        for lane in 0..LANES {
            let [a, b, c, d] = self.pieces[usize::from(index[lane])];
            let u = within[lane];
            value[lane] = a + u * (b + u * (c + u * d));
            derivative[lane] = (b + u * (2.0 * c + u * 3.0 * d)) * self.knots_per_m;
        }
    }
}

/// A polynomial's coefficients by order.
pub(crate) struct PolynomialLanes {
    series: Series,
    middle: f32,
    inverse_half: f32,
}

impl PolynomialLanes {
    pub(crate) fn new(polynomial: &RangePolynomial) -> Self {
        let [low, high] = polynomial.range_span_m;
        let mut series = Series::default();
        for (place, q) in series.coefficients[1..].iter_mut().zip(&polynomial.coefficients) {
            *place = *q as f32;
        }
        series.order = polynomial.coefficients.len();
        Self { series, middle: f64::midpoint(low, high) as f32, inverse_half: (2.0 / (high - low)) as f32 }
    }

    /// Values and derivatives with respect to the range; both without meaning outside the span.
    #[inline(always)]
    pub(crate) fn put(&self, range: &Lanes, value: &mut Lanes, derivative: &mut Lanes) {
        let mut t = [0.0; LANES];
        for (t, range) in t.iter_mut().zip(range) {
            *t = ((range - self.middle) * self.inverse_half).clamp(-1.0, 1.0);
        }
        self.series.put(&t, value, derivative);
        for derivative in derivative {
            *derivative *= self.inverse_half;
        }
    }
}

/// A surface over the image of one format.
pub(crate) struct SurfaceLanes {
    /// By order in x and order in y.
    coefficients: [[f64; ORDERS]; ORDERS],
    order: usize,
    /// Reduced coordinate of the first column and its step, of the first row and its step.
    columns: [f64; 2],
    rows: [f64; 2],
}

impl SurfaceLanes {
    /// `first_mm` is the first pixel's image point from the principal point, `step_mm` the way to the next column and row.
    pub(crate) fn new(surface: &ImageSurface, first_mm: [f64; 2], step_mm: [f64; 2]) -> Self {
        let line = |[low, high]: [f64; 2], first: f64, step: f64| {
            [(2.0 * first - low - high) / (high - low), 2.0 * step / (high - low)]
        };
        let mut coefficients = [[0.0; ORDERS]; ORDERS];
        for ([i, j], g) in surface.exponents().zip(&surface.coefficients) {
            coefficients[i][j] = *g;
        }
        Self {
            coefficients,
            order: surface.shape().order,
            columns: line(surface.x_span_mm, first_mm[0], step_mm[0]),
            rows: line(surface.y_span_mm, first_mm[1], step_mm[1]),
        }
    }

    /// Values of the block that begins at `(column, row)`; pixels outside the spans are no longer `known`.
    #[inline(always)]
    pub(crate) fn put(&self, column: usize, row: usize, value: &mut Lanes, known: &mut Mask) {
        let down = self.rows[0] + row as f64 * self.rows[1];
        let row_in_span = down.abs() <= 1.0 + EDGE;
        let mut reduced = [0.0; LANES];
        for lane in 0..LANES {
            let t = self.columns[0] + (column + lane) as f64 * self.columns[1];
            reduced[lane] = t.clamp(-1.0, 1.0) as f32;
            known[lane] &= u32::from((t.abs() <= 1.0 + EDGE) & row_in_span).wrapping_neg();
        }
        self.of_row(down).put(&reduced, value, &mut [0.0; LANES]);
    }

    /// What is left of the surface in one row: a series in x.
    fn of_row(&self, down: f64) -> Series {
        let y = Legendre::on_span([-1.0, 1.0], down);
        let by_order =
            self.coefficients.map(|of_y| of_y.iter().zip(y.value).map(|(g, value)| g * value).sum::<f64>() as f32);
        Series { coefficients: by_order, order: self.order }
    }
}

/// Orders that a series may have, zero among them.
const ORDERS: usize = crate::legendre::MOST_ORDER + 1;

/// A series of Legendre polynomials.
#[derive(Default)]
struct Series {
    coefficients: [f32; ORDERS],
    order: usize,
}

impl Series {
    /// Values and derivatives by Bonnet's recursion.
    #[inline(always)]
    fn put(&self, t: &Lanes, value: &mut Lanes, slope: &mut Lanes) {
        let [constant, linear, ..] = self.coefficients;
        for lane in 0..LANES {
            value[lane] = constant + linear * t[lane];
            slope[lane] = linear;
        }
        let (mut before, mut last) = ([1.0; LANES], *t);
        let (mut slope_before, mut slope_last) = ([0.0; LANES], [1.0; LANES]);
        for order in 2..=self.order.min(ORDERS - 1) {
            let (k, coefficient) = (order as f32, self.coefficients[order]);
            let (growth, decay) = ((2.0 * k - 1.0) / k, (k - 1.0) / k);
            for lane in 0..LANES {
                let next = growth * t[lane] * last[lane] - decay * before[lane];
                let slope_next = slope_before[lane] + (2.0 * k - 1.0) * last[lane];
                (before[lane], last[lane]) = (last[lane], next);
                (slope_before[lane], slope_last[lane]) = (slope_last[lane], slope_next);
                value[lane] += coefficient * next;
                slope[lane] += coefficient * slope_next;
            }
        }
    }
}
