//! Derivatives of an image by central differences.

use range_image::Raster;

/// First and second derivatives at a pixel, per pixel and per square pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Derivatives {
    /// Along columns and rows.
    pub(crate) gradient: [f64; 2],
    /// Twice along columns, mixed, twice along rows.
    pub(crate) hessian: [f64; 3],
}

impl Derivatives {
    /// The derivatives at a pixel that does not lie at the rim; `None` there.
    pub(crate) fn at(image: &Raster<f32>, col: usize, row: usize) -> Option<Self> {
        let inner = |at: usize, size: usize| at >= 1 && at + 1 < size;
        if !(inner(col, image.width()) && inner(row, image.height())) {
            return None;
        }
        let (width, values) = (image.width(), image.as_slice());
        let centre = row * width + col;
        let at = |index: usize| f64::from(values[index]);
        let (left, right) = (at(centre - 1), at(centre + 1));
        let (above, below) = (at(centre - width), at(centre + width));
        let mixed = at(centre + width + 1) + at(centre - width - 1) - at(centre + width - 1) - at(centre - width + 1);
        Some(Self {
            gradient: [0.5 * (right - left), 0.5 * (below - above)],
            hessian: [left + right - 2.0 * at(centre), 0.25 * mixed, above + below - 2.0 * at(centre)],
        })
    }

    /// Minus the determinant of the second derivatives: positive at saddles.
    pub(crate) fn saddle(&self) -> f64 {
        let [xx, xy, yy] = self.hessian;
        xy * xy - xx * yy
    }

    /// Where the gradient vanishes, as an offset (pixel) from the pixel; `None` where the surface has no curvature.
    pub(crate) fn stationary(&self) -> Option<[f64; 2]> {
        let ([x, y], [xx, xy, yy]) = (self.gradient, self.hessian);
        let determinant = xx * yy - xy * xy;
        let offset = [(xy * y - yy * x) / determinant, (xy * x - xx * y) / determinant];
        offset.iter().all(|value| value.is_finite()).then_some(offset)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_quadratic_saddle_is_exact() {
        let surface = |x: f64, y: f64| 1.0 + (x - 4.3) * (y - 3.8) + 0.5 * (x - 4.3).powi(2);
        let image = Raster::from_fn(9, 9, |col, row| surface(col as f64, row as f64) as f32);
        let found = Derivatives::at(&image, 4, 4).unwrap();
        let offset = found.stationary().unwrap();
        assert!((offset[0] - 0.3).abs() < 1e-5 && (offset[1] + 0.2).abs() < 1e-5, "{offset:?}");
        assert!((found.saddle() - 1.0).abs() < 1e-5);
        assert!(Derivatives::at(&image, 0, 4).is_none() && Derivatives::at(&image, 4, 8).is_none());
        assert!(Derivatives::at(&Raster::filled(5, 5, 1.0), 2, 2).unwrap().stationary().is_none());
    }
}
