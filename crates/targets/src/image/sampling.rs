//! Values between pixels.

use range_image::Raster;

/// The value at a pixel position `(col, row)`, linear between the four pixels about it; NaN outside the image and where
/// one of the four has no value.
pub(crate) fn bilinear(image: &Raster<f32>, [col, row]: [f64; 2]) -> f32 {
    let (width, height) = (image.width(), image.height());
    // Written so that NaN is outside.
    let inside = col >= 0.0 && row >= 0.0 && col <= width as f64 - 1.0 && row <= height as f64 - 1.0;
    if !inside {
        return f32::NAN;
    }
    let (left, top) = ((col as usize).min(width.saturating_sub(2)), (row as usize).min(height.saturating_sub(2)));
    let [x, y] = [(col - left as f64) as f32, (row - top as f64) as f32];
    let values = image.as_slice();
    let at = |col: usize, row: usize| values[row.min(height - 1) * width + col.min(width - 1)];
    let upper = at(left, top) * (1.0 - x) + at(left + 1, top) * x;
    let lower = at(left, top + 1) * (1.0 - x) + at(left + 1, top + 1) * x;
    upper * (1.0 - y) + lower * y
}

#[cfg(test)]
mod tests {
    #![allow(clippy::float_cmp)]
    use super::*;

    #[test]
    fn a_bilinear_surface_is_reproduced_and_outside_is_nan() {
        let image = Raster::from_fn(5, 4, |col, row| (col * row) as f32 + col as f32);
        assert!((bilinear(&image, [2.25, 1.5]) - (2.25 * 1.5 + 2.25)).abs() < 1e-6);
        assert_eq!(bilinear(&image, [4.0, 3.0]), 16.0);
        for outside in [[-0.1, 0.0], [4.1, 0.0], [0.0, 3.1], [f64::NAN, 0.0], [f64::INFINITY, 0.0]] {
            assert!(bilinear(&image, outside).is_nan());
        }
        assert_eq!(bilinear(&Raster::filled(1, 1, 2.0), [0.0, 0.0]), 2.0);
        assert!(bilinear(&Raster::filled(0, 0, 2.0), [0.0, 0.0]).is_nan());
    }
}
