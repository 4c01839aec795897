//! Gaussian smoothing, holes filled and half the size.

use range_image::Raster;

/// An image without holes: pixels without a value take that of the nearest pixel of their row that has one, rows without
/// any that of the nearest row. `None` where no pixel has a value.
pub(crate) fn filled(image: &Raster<f32>) -> Option<Raster<f32>> {
    if !image.as_slice().iter().any(|value| value.is_finite()) {
        return None;
    }
    let mut out = image.clone();
    let width = image.width();
    let mut empty = Vec::new();
    for (row, values) in out.as_mut_slice().chunks_exact_mut(width).enumerate() {
        if !fill_row(values) {
            empty.push(row);
        }
    }
    let is_full = |row: &usize| empty.binary_search(row).is_err();
    let full: Vec<usize> = (0..image.height()).filter(is_full).collect();
    for row in empty {
        let nearest = full.iter().copied().min_by_key(|other| other.abs_diff(row)).unwrap_or(row);
        out.as_mut_slice().copy_within(nearest * width..(nearest + 1) * width, row * width);
    }
    Some(out)
}

/// Fills a row's holes from the nearest values; `false` where the row has none.
fn fill_row(values: &mut [f32]) -> bool {
    let mut left: Option<usize> = None;
    let mut col = 0;
    while col < values.len() {
        if values[col].is_finite() {
            left = Some(col);
            col += 1;
            continue;
        }
        let end = (col..values.len()).find(|&next| values[next].is_finite());
        for hole in col..end.unwrap_or(values.len()) {
            let source = match (left, end) {
                (Some(l), Some(r)) => {
                    if hole - l <= r - hole {
                        l
                    } else {
                        r
                    }
                }
                (Some(only), None) | (None, Some(only)) => only,
                (None, None) => return false,
            };
            values[hole] = values[source];
        }
        col = end.unwrap_or(values.len());
    }
    left.is_some()
}

/// An image convolved with a Gaussian of the deviation `sigma` (pixel), mirrored at its rims. Holes must be filled before.
pub(crate) fn gaussian(image: &Raster<f32>, sigma: f64) -> Raster<f32> {
    let weights = weights(sigma);
    let along_rows = convolve_rows(image, &weights);
    convolve_columns(&along_rows, &weights)
}

/// The weights of a Gaussian at 0, 1, 2 ... pixels, cut at 3 deviations (beyond lie 0.3 %), both sides summing to one.
fn weights(sigma: f64) -> Vec<f32> {
    let reach = (3.0 * sigma).ceil().max(0.0) as usize;
    let raw: Vec<f64> = (0..=reach).map(|k| (-0.5 * (k as f64 / sigma.max(1e-6)).powi(2)).exp()).collect();
    let sum = raw[0] + 2.0 * raw[1..].iter().sum::<f64>();
    raw.iter().map(|weight| (weight / sum) as f32).collect()
}

/// The index mirrored into `0..size`.
fn mirrored(index: isize, size: usize) -> usize {
    let last = size as isize - 1;
    let once = if index < 0 {
        -index
    } else if index > last {
        2 * last - index
    } else {
        index
    };
    once.clamp(0, last) as usize
}

fn convolve_rows(image: &Raster<f32>, weights: &[f32]) -> Raster<f32> {
    let width = image.width();
    let reach = weights.len() - 1;
    let mut out = Raster::filled(width, image.height(), 0.0);
    let mut padded = vec![0.0_f32; width + 2 * reach];
    for (values, to) in image.rows().zip(out.as_mut_slice().chunks_exact_mut(width.max(1))) {
        for (index, value) in padded.iter_mut().enumerate() {
            *value = values[mirrored(index as isize - reach as isize, width)];
        }
        for (value, centre) in to.iter_mut().zip(&padded[reach..]) {
            *value = weights[0] * centre;
        }
        for (k, weight) in weights.iter().enumerate().skip(1) {
            let pairs = padded[reach - k..].iter().zip(&padded[reach + k..]);
            for (value, (left, right)) in to.iter_mut().zip(pairs) {
                *value += weight * (left + right);
            }
        }
    }
    out
}

fn convolve_columns(image: &Raster<f32>, weights: &[f32]) -> Raster<f32> {
    let (width, height) = (image.width(), image.height());
    let mut out = Raster::filled(width, height, 0.0);
    let values = image.as_slice();
    let row_at = |row: isize| {
        let start = mirrored(row, height) * width;
        &values[start..start + width]
    };
    for (row, to) in out.as_mut_slice().chunks_exact_mut(width.max(1)).enumerate() {
        for (value, centre) in to.iter_mut().zip(row_at(row as isize)) {
            *value = weights[0] * centre;
        }
        for (k, weight) in weights.iter().enumerate().skip(1) {
            let (above, below) = (row_at(row as isize - k as isize), row_at(row as isize + k as isize));
            for ((value, above), below) in to.iter_mut().zip(above).zip(below) {
                *value += weight * (above + below);
            }
        }
    }
    out
}

/// The image at half the size: each pixel the mean of four. A pixel `(c, r)` of it lies at `(2c + ½, 2r + ½)` of the
/// image. A last odd column or row is left out.
pub(crate) fn halved(image: &Raster<f32>) -> Raster<f32> {
    let (width, values) = (image.width(), image.as_slice());
    Raster::from_fn(width / 2, image.height() / 2, |col, row| {
        let corner = 2 * row * width + 2 * col;
        0.25 * (values[corner] + values[corner + 1] + values[corner + width] + values[corner + width + 1])
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::float_cmp)]
    use super::*;

    #[test]
    fn smoothing_an_impulse_gives_a_gaussian() {
        let impulse = Raster::from_fn(31, 31, |col, row| f32::from(u8::from((col, row) == (15, 15))));
        let smooth = gaussian(&impulse, 2.0);
        assert!((smooth.as_slice().iter().sum::<f32>() - 1.0).abs() < 1e-5);
        let expected = 1.0 / (8.0 * std::f32::consts::PI);
        assert!((smooth[(15, 15)] / expected - 1.0).abs() < 0.01);
        assert!((smooth[(17, 15)] / smooth[(15, 15)] - (-0.5_f32).exp()).abs() < 1e-3);
    }

    #[test]
    fn constants_stay_and_tiny_images_pass() {
        for (width, height) in [(1, 1), (2, 1), (3, 5), (0, 0), (0, 4)] {
            let smooth = gaussian(&Raster::filled(width, height, 4.0), 1.5);
            assert!(smooth.as_slice().iter().all(|value| (value - 4.0).abs() < 1e-5));
            halved(&smooth);
        }
    }

    #[test]
    fn holes_take_the_nearest_value() {
        let nan = f32::NAN;
        let image = Raster::from_vec(3, 3, vec![nan, 1.0, nan, nan, nan, nan, 5.0, nan, 7.0]).unwrap();
        let full = filled(&image).unwrap();
        assert_eq!(full.as_slice(), &[1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 5.0, 5.0, 7.0]);
        assert!(filled(&Raster::filled(2, 2, nan)).is_none());
        assert!(filled(&Raster::filled(0, 0, nan)).is_none());
    }
}
