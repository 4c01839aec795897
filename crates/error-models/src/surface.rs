//! A surface over the image, instead of the plane `e1 x + e2 y` of Eq. 14.

use range_image::ImageFormat;

use crate::error::{require_count, require_finite, require_span};
use crate::models::legendre::{Legendre, reduced};
use crate::{Error, ImageSurface, Result, SurfaceShape};

/// Part of the half span by which an image point may lie outside it and still be called inside: rounding.
pub(crate) const EDGE: f64 = 1e-6;

impl ImageSurface {
    /// Lowest and highest order.
    pub const ORDERS: [usize; 2] = [1, 6];

    /// The surface that is zero everywhere; refuses an order outside [`Self::ORDERS`] and bad spans.
    pub fn zero(shape: &SurfaceShape) -> Result<Self> {
        require_count("surface order", shape.order, Self::ORDERS)?;
        let coefficients = vec![0.0; exponents(shape.order).count()];
        let zero = Self { x_span_mm: shape.x_span_mm, y_span_mm: shape.y_span_mm, coefficients };
        zero.validate()?;
        Ok(zero)
    }

    /// Order and spans.
    pub fn shape(&self) -> SurfaceShape {
        SurfaceShape { order: self.order(), x_span_mm: self.x_span_mm, y_span_mm: self.y_span_mm }
    }

    /// Sum of the two orders of its highest terms.
    fn order(&self) -> usize {
        (1..=Self::ORDERS[1]).find(|order| exponents(*order).count() >= self.coefficients.len()).unwrap_or(0)
    }

    /// Order in x and in y of each coefficient: 10, 01, 20, 11, 02, 30, ...
    pub(crate) fn exponents(&self) -> impl Iterator<Item = [usize; 2]> + use<> {
        exponents(self.order())
    }

    /// `Δρ` in metre at an image point from the principal point. Beyond the spans it stays as it is at their edge.
    pub fn value(&self, x_mm: f64, y_mm: f64) -> f64 {
        let (x, y) = self.bases(x_mm, y_mm);
        let terms = self.coefficients.iter().zip(self.exponents());
        terms.map(|(g, [i, j])| g * x.value[i] * y.value[j]).sum()
    }

    /// `∂Δρ/∂(x, y)`, metre per millimetre; zero beyond the spans.
    pub fn gradient(&self, x_mm: f64, y_mm: f64) -> [f64; 2] {
        let (x, y) = self.bases(x_mm, y_mm);
        let terms = self.coefficients.iter().zip(self.exponents());
        terms.fold([0.0, 0.0], |sum, (g, [i, j])| {
            [sum[0] + g * x.derivative[i] * y.value[j], sum[1] + g * x.value[i] * y.derivative[j]]
        })
    }

    /// `∂Δρ/∂(g10, g01, ..)`. `row` has one place for each coefficient; places beyond them are left alone.
    pub fn design_row(&self, x_mm: f64, y_mm: f64, row: &mut [f64]) {
        let (x, y) = self.bases(x_mm, y_mm);
        let places = row.iter_mut().take(self.coefficients.len());
        places.zip(self.exponents()).for_each(|(place, [i, j])| *place = x.value[i] * y.value[j]);
    }

    /// Whether an image point lies in the spans; NaN does not.
    pub fn in_span(&self, x_mm: f64, y_mm: f64) -> bool {
        let inside = |span, position| reduced(span, position).abs() <= 1.0 + EDGE;
        inside(self.x_span_mm, x_mm) && inside(self.y_span_mm, y_mm)
    }

    /// Refuses a number of coefficients that no order in [`Self::ORDERS`] has, bad spans and coefficients that are not
    /// finite.
    pub fn validate(&self) -> Result<()> {
        let count = self.coefficients.len();
        if count == 0 || exponents(self.order()).count() != count {
            let expected = "a surface of order 1, 2, 3, 4, 5, 6 has 2, 5, 9, 14, 20, 27 coefficients";
            return Err(Error::OutOfDomain { name: "surface coefficients", value: count as f64, expected });
        }
        require_span("surface x_span_mm", self.x_span_mm)?;
        require_span("surface y_span_mm", self.y_span_mm)?;
        self.coefficients.iter().try_for_each(|value| require_finite("surface coefficient", *value))
    }

    fn bases(&self, x_mm: f64, y_mm: f64) -> (Legendre, Legendre) {
        (Legendre::on_span(self.x_span_mm, x_mm), Legendre::on_span(self.y_span_mm, y_mm))
    }
}

impl SurfaceShape {
    /// A surface over all pixels of an image, `principal_point_mm` being (xp, yp).
    pub fn over_image(order: usize, format: &ImageFormat, principal_point_mm: [f64; 2]) -> Self {
        let last = [format.width.saturating_sub(1) as f64, format.height.saturating_sub(1) as f64];
        let [left, top] = format.image_from_pixel([0.0, 0.0]);
        let [right, bottom] = format.image_from_pixel(last);
        let [xp, yp] = principal_point_mm;
        Self { order, x_span_mm: [left - xp, right - xp], y_span_mm: [bottom - yp, top - yp] }
    }
}

fn exponents(order: usize) -> impl Iterator<Item = [usize; 2]> {
    (1..=order).flat_map(|sum| (0..=sum).map(move |of_y| [sum - of_y, of_y]))
}
