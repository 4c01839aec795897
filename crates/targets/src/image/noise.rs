//! The noise of an image, from the image itself.

use range_image::Raster;

/// Standard deviation of the response of [`second_differences`] to white noise of deviation one: the root of the sum of
/// its squared weights, 4² + 4·2² + 4·1².
const RESPONSE_TO_WHITE_NOISE: f64 = 6.0;

/// Share of the responses that lies below the one that is looked at. At a half, a picture in which every other pixel is
/// an edge would pass for noise; far below a quarter few pixels decide.
const SHARE: f64 = 0.25;

/// The modulus of a standard normal value that [`SHARE`] of all lie below: Φ⁻¹(5/8).
const QUARTILE_OF_MODULUS: f64 = 0.318_639_363_964_375_2;

/// Standard deviation of a rounding to whole steps, in steps: 1/√12.
const SIGMA_OF_ROUNDING: f64 = 0.288_675_134_594_812_9;

/// Levels of an image at least that rounding is the cause of: an image of two or three is drawn.
const FEWEST_LEVELS: usize = 4;

/// How many values the step of rounding is looked for in: enough that two neighbouring levels of 256 are among them.
const SAMPLE_OF_LEVELS: usize = 4096;

/// Standard deviation of the noise of an image, in the unit of its values: from second differences along both axes
/// \[Immerkaer1996\], to which slopes and straight edges along an axis add nothing, and their lower quartile, to which
/// other edges add little. At least the noise of rounding, where values come in steps; areas of the least or largest value
/// alone (empty, saturated) do not count. Zero of a constant image; NaN where no pixel has a value and eight neighbours with one.
pub(crate) fn noise_deviation(image: &Raster<f32>) -> f64 {
    let mut responses = Vec::with_capacity(image.len());
    let rows: Vec<&[f32]> = image.rows().collect();
    let mut complete = 0_usize;
    let finite = || image.as_slice().iter().copied().filter(|value| value.is_finite());
    let ends = [finite().fold(f32::INFINITY, f32::min), finite().fold(f32::NEG_INFINITY, f32::max)];
    for three in rows.windows(3) {
        for col in 1..image.width().saturating_sub(1) {
            let [value, largest] = second_differences(three, col);
            complete += usize::from(value.is_finite());
            if value.is_finite() && (largest > 0.0 || !ends.contains(&three[1][col])) {
                responses.push(value.abs());
            }
        }
    }
    if complete == 0 {
        return f64::NAN;
    }
    if responses.is_empty() {
        return 0.0;
    }
    let spread = f64::from(statistics::ranked(&mut responses, SHARE)) / QUARTILE_OF_MODULUS / RESPONSE_TO_WHITE_NOISE;
    spread.max(SIGMA_OF_ROUNDING * step(image))
}

/// The second difference along rows of that along columns at the middle row, and the largest of its parts.
fn second_differences(rows: &[&[f32]], col: usize) -> [f32; 2] {
    let along_columns = |col: usize| (rows[0][col] - rows[1][col]) - (rows[1][col] - rows[2][col]);
    let parts = [col - 1, col, col + 1].map(along_columns);
    let along_row = |row: &[f32]| (row[col - 1] - row[col]).abs().max((row[col] - row[col + 1]).abs());
    let largest = parts.iter().fold(along_row(rows[1]), |largest, part| largest.max(part.abs()));
    [(parts[0] - parts[1]) - (parts[1] - parts[2]), largest]
}

/// The least difference between values of an image that are not equal: the step of rounding, if there is one. Zero of an
/// image of a few levels.
fn step(image: &Raster<f32>) -> f64 {
    let stride = (image.len() / SAMPLE_OF_LEVELS).max(1);
    let mut levels: Vec<f32> = image.as_slice().iter().step_by(stride).copied().filter(|v| v.is_finite()).collect();
    levels.sort_unstable_by(f32::total_cmp);
    levels.dedup();
    if levels.len() < FEWEST_LEVELS {
        return 0.0;
    }
    let steps = levels.windows(2).map(|two| f64::from(two[1]) - f64::from(two[0])).filter(|step| *step > 0.0);
    let least = steps.fold(f64::INFINITY, f64::min);
    if least.is_finite() { least } else { 0.0 }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::float_cmp)]
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};

    use super::*;

    fn noisy(sigma: f32, seed: u64, pattern: impl Fn(usize, usize) -> f32) -> Raster<f32> {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
        let normal = Normal::new(0.0, sigma).unwrap();
        Raster::from_fn(120, 90, |col, row| pattern(col, row) + normal.sample(&mut random))
    }

    #[test]
    fn noise_on_slopes_and_fields_is_found() {
        let slope = noisy(2.0, 1, |col, row| 3.0 * col as f32 - row as f32);
        assert!((noise_deviation(&slope) / 2.0 - 1.0).abs() < 0.05, "{}", noise_deviation(&slope));
        let fields = noisy(2.0, 2, |col, row| if (col / 12 + row / 12) % 2 == 0 { 20.0 } else { 200.0 });
        assert!((noise_deviation(&fields) / 2.0 - 1.0).abs() < 0.1, "{}", noise_deviation(&fields));
    }

    #[test]
    fn rounding_is_noise() {
        let smooth = Raster::from_fn(100, 80, |col, row| (0.03 * (col + row) as f32).round());
        assert!((noise_deviation(&smooth) - SIGMA_OF_ROUNDING).abs() < 0.15, "{}", noise_deviation(&smooth));
    }

    #[test]
    fn images_without_noise_or_values_have_an_answer() {
        assert_eq!(noise_deviation(&Raster::filled(20, 20, 3.0)), 0.0);
        assert!(noise_deviation(&Raster::filled(20, 20, f32::NAN)).is_nan());
        assert!(noise_deviation(&Raster::filled(1, 1, 3.0)).is_nan());
        assert!(noise_deviation(&Raster::filled(0, 0, 3.0)).is_nan());
    }
}
