//! Points of light.
//!
//! A light smaller than a pixel is seen as the point spread function of the lens, averaged over pixels: `I = level + L g(c) g(r)`
//! with `g` the share of a Gaussian of deviation σ that falls on the pixel's column or row, and L all its light.

use adjust::{Adjustment, Covariance, FunctionObservation, LinearObservation, ParameterBlock, Scale, SolveOptions};
use nalgebra::{Matrix2, SMatrix};
use range_image::Raster;
use statistics::{robust_standard_deviation, upper_median};

use crate::error::{Error, Result};
use crate::image::levels::Levels;
use crate::image::noise::noise_deviation;
use crate::image::normal_table::NormalTable;
use crate::image::smoothing::{filled, gaussian};
use crate::sightings::measured_point::MeasuredPoint;

/// Smoothing before the search, pixel: about the point spread of a lens.
const SMOOTHING_PX: f64 = 0.8;
/// Pixels about a light that are looked at, in parts of the largest spread.
const WINDOW_SPREADS: f64 = 3.0;
/// Parameters: level, light, column, row, spread.
const PARAMETERS: usize = 5;
/// Spread that is expected and its deviation, as logarithm: a weak prior for lights that are hardly above the noise.
const EXPECTED_SPREAD: [f64; 2] = [-0.35, 0.7];
/// Largest part of a light's height that the residuals may be beside the noise: more is a lamp, a disc or an edge.
const LARGEST_MISFIT: f64 = 0.08;
/// Share of the ring about a window that must be dark: a light stands alone.
const LARGEST_RING_PARTS: f64 = 0.25;

/// How lights are looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightOptions {
    /// Smallest height above its ground in standard deviations of the noise. Default: 8, one false light in 10¹³ pixels of noise.
    pub smallest_height_sigmas: f64,
    /// Smallest and largest spread (standard deviation) of a light, pixel. Default: 0.3 to 2.5.
    pub spread_px: [f64; 2],
    /// Value from which on a pixel is saturated and does not take part, unit of the image. Default: `None`, the value at which the
    /// image has a plateau.
    pub saturation: Option<f64>,
    /// Standard deviation of a pixel's noise, unit of the image. Default: `None`, estimated from the image.
    pub noise: Option<f64>,
}

impl Default for LightOptions {
    fn default() -> Self {
        Self { smallest_height_sigmas: 8.0, spread_px: [0.3, 2.5], saturation: None, noise: None }
    }
}

impl LightOptions {
    fn validate(&self) -> Result<()> {
        let [small, large] = self.spread_px;
        if !(small > 0.0 && small <= large && large <= 50.0) {
            let expected = "spreads are positive, the smaller first, and at most 50 pixels";
            return Err(Error::Invalid { name: "spread_px", value: large, expected });
        }
        let value = self.smallest_height_sigmas;
        if value.is_nan() || value < 0.0 {
            return Err(Error::Invalid { name: "smallest_height_sigmas", value, expected: "not negative" });
        }
        if let Some(value) = self.noise.filter(|noise| !(noise.is_finite() && *noise > 0.0)) {
            let expected = "a standard deviation is positive and finite";
            return Err(Error::Invalid { name: "noise", value, expected });
        }
        match self.saturation {
            Some(value) if value.is_nan() => Err(Error::Invalid { name: "saturation", value, expected: "a value" }),
            _ => Ok(()),
        }
    }
}

/// A point of light that was seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightSighting {
    /// Its centre.
    pub centre: MeasuredPoint,
    /// All its light above the ground, unit of the image times square pixel.
    pub light: f64,
    /// Standard deviation of the light.
    pub light_sigma: f64,
    /// Spread: standard deviation of the Gaussian, without the pixel, pixel.
    pub spread_px: f64,
    /// Standard deviation of unit weight.
    pub sigma0: f64,
    /// Whether pixels were saturated: they did not take part, and the centre rests on the flanks.
    pub saturated: bool,
}

/// Finds points of light (infrared LEDs, reflecting dots of less than a pixel) and measures their centres: a Gaussian averaged over
/// pixels, fitted by least squares. They come by row, then column.
///
/// # Errors
/// [`Error::Invalid`] for options that cannot be met.
///
/// ```
/// use targets::range_image::Raster;
/// use targets::{LightOptions, find_lights};
///
/// let light = |col: f64, row: f64| 500.0 * (-((col - 20.3).powi(2) + (row - 14.6).powi(2)) / 1.6).exp();
/// let image = Raster::from_fn(40, 30, |col, row| (10.0 + light(col as f64, row as f64)) as f32);
/// let found = find_lights(&image, &LightOptions::default())?;
/// assert!(found.len() == 1 && (found[0].centre.pixel[0] - 20.3).abs() < 0.01);
/// # Ok::<(), targets::Error>(())
/// ```
pub fn find_lights(image: &Raster<f32>, options: &LightOptions) -> Result<Vec<LightSighting>> {
    options.validate()?;
    let Some(whole) = filled(image) else { return Ok(Vec::new()) };
    let noise = options.noise.unwrap_or_else(|| noise_deviation(image)).max(0.0);
    let plateau = || Levels::of(image, noise).and_then(|levels| levels.plateau);
    let saturation = options.saturation.or_else(plateau).unwrap_or(f64::INFINITY);
    let search = Search { image, noise, saturation, options };
    let smoothed = gaussian(&whole, SMOOTHING_PX);
    let mut found: Vec<LightSighting> = Vec::new();
    for row in 0..image.height() {
        for col in 0..image.width() {
            let sighting = if is_peak(&smoothed, [col, row]) { search.sighting([col, row]) } else { None };
            let near = |own: &LightSighting, other: &LightSighting| {
                let [a, b] = [own, other].map(|light| light.centre.pixel);
                (a[0] - b[0]).hypot(a[1] - b[1]) < 1.0
            };
            found.extend(sighting.filter(|own| !found.iter().any(|other| near(own, other))));
        }
    }
    let key = |light: &LightSighting| [light.centre.pixel[1], light.centre.pixel[0]];
    found.sort_by(|a, b| key(a)[0].total_cmp(&key(b)[0]).then(key(a)[1].total_cmp(&key(b)[1])));
    Ok(found)
}

/// Whether no pixel of the eight about one is brighter, and one is darker.
fn is_peak(image: &Raster<f32>, [col, row]: [usize; 2]) -> bool {
    let own = image[(col, row)];
    let about = (0..9).filter_map(|k| {
        let (c, r) = ((col + k % 3).checked_sub(1)?, (row + k / 3).checked_sub(1)?);
        image.get(c, r).copied()
    });
    let (mut least, mut most) = (own, own);
    for value in about {
        (least, most) = (least.min(value), most.max(value));
    }
    own >= most && least < own
}

struct Search<'a> {
    image: &'a Raster<f32>,
    noise: f64,
    saturation: f64,
    options: &'a LightOptions,
}

impl Search<'_> {
    fn sighting(&self, peak: [usize; 2]) -> Option<LightSighting> {
        // The window grows until its rim is dark.
        let largest = (WINDOW_SPREADS * self.options.spread_px[1]).ceil() as usize + 1;
        let reach = (3..=largest.max(3)).find(|reach| self.is_alone(peak, *reach))?;
        let pixels = self.window(peak, reach);
        let (kept, saturated): (Vec<_>, Vec<_>) = pixels.into_iter().partition(|(_, value)| *value < self.saturation);
        if kept.len() < 3 * PARAMETERS {
            return None;
        }
        let level = upper_median(&mut kept.iter().map(|(_, value)| *value).collect::<Vec<_>>());
        let top = kept.iter().map(|(_, value)| *value).fold(f64::NEG_INFINITY, f64::max);
        let height = top - level;
        if !(height > 0.0 && height >= self.options.smallest_height_sigmas * self.noise) {
            return None;
        }
        let middle = Self::middle(&kept, &saturated, level);
        let sigma = self.noise.max(1e-3 * height);
        let start = [level, 6.0 * height, middle[0], middle[1], EXPECTED_SPREAD[0]];
        let (values, covariance, squares) = adjusted(&kept, &start, sigma).ok()?;
        let redundancy = (kept.len() - PARAMETERS) as f64;
        let scatter = squares / redundancy;
        let spread = values[4].exp();
        let peak_height = values[1] / (std::f64::consts::TAU * (spread * spread + 1.0 / 12.0));
        let misfit = (scatter - sigma * sigma).max(0.0).sqrt() / peak_height;
        let [small, large] = self.options.spread_px;
        let off = (values[2] - middle[0]).hypot(values[3] - middle[1]);
        let good = (small..=large).contains(&spread)
            && values[1] > 0.0
            && misfit <= LARGEST_MISFIT
            && off <= 1.0 + spread
            && peak_height >= self.options.smallest_height_sigmas * self.noise;
        good.then(|| LightSighting {
            centre: MeasuredPoint {
                pixel: [values[2], values[3]],
                covariance: Matrix2::from_fn(|row, column| covariance[(2 + row, 2 + column)])
                    * (scatter / (sigma * sigma)),
            },
            light: values[1],
            light_sigma: (covariance[(1, 1)] * scatter).sqrt() / sigma,
            spread_px: spread,
            sigma0: scatter.sqrt() / sigma,
            saturated: !saturated.is_empty(),
        })
    }

    /// Whether the rim of the window is dark against its middle, and even.
    fn is_alone(&self, [col, row]: [usize; 2], reach: usize) -> bool {
        let on_rim =
            |pixel: &[f64; 2]| (pixel[0] - col as f64).abs().max((pixel[1] - row as f64).abs()) > reach as f64 - 0.5;
        let rim: Vec<f64> =
            self.window([col, row], reach).iter().filter(|(pixel, _)| on_rim(pixel)).map(|(_, value)| *value).collect();
        let level = upper_median(&mut rim.clone());
        let brightest = rim.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let height = f64::from(self.image[(col, row)]) - level;
        height > 0.0
            && brightest - level <= LARGEST_RING_PARTS * height + 4.0 * self.noise
            && robust_standard_deviation(&rim) <= 0.1 * height + 2.0 * self.noise
    }

    fn window(&self, [col, row]: [usize; 2], reach: usize) -> Vec<([f64; 2], f64)> {
        let range = |middle: usize, size: usize| middle.saturating_sub(reach)..(middle + reach + 1).min(size);
        let rows = range(row, self.image.height());
        let places = rows.flat_map(|row| range(col, self.image.width()).map(move |col| (col, row)));
        let value = |(col, row)| ([col as f64, row as f64], f64::from(self.image[(col, row)]));
        places.map(value).filter(|(_, value)| value.is_finite()).collect()
    }

    /// Centre of the plateau, or of the light above half of the height.
    fn middle(kept: &[([f64; 2], f64)], saturated: &[([f64; 2], f64)], level: f64) -> [f64; 2] {
        let top = kept.iter().map(|(_, value)| *value).fold(f64::NEG_INFINITY, f64::max);
        let above = |(pixel, value): &([f64; 2], f64)| (*pixel, value - 0.5 * (level + top));
        let plateau: Vec<_> = saturated.iter().map(|(pixel, _)| (*pixel, 1.0)).collect();
        let bright: Vec<_> = kept.iter().map(above).filter(|(_, above)| *above > 0.0).collect();
        let points = if plateau.is_empty() { bright } else { plateau };
        let sum: f64 = points.iter().map(|(_, weight)| weight).sum();
        [0, 1].map(|axis| points.iter().map(|(pixel, weight)| pixel[axis] * weight).sum::<f64>() / sum)
    }
}

/// Value of a pixel, and its derivatives by the parameters; the last is the logarithm of the spread.
fn value(parameters: &[f64], pixel: [f64; 2]) -> (f64, [f64; PARAMETERS]) {
    let table = NormalTable::new();
    let spread = parameters[4].exp();
    // Share of the Gaussian on the pixel, its derivative by the centre and by the logarithm of the spread.
    let share = |axis: usize| {
        let off = pixel[axis] - parameters[2 + axis];
        let [low, high] = [-0.5, 0.5].map(|half| (off + half) / spread);
        let ([low_profile, high_profile], [low_density, high_density]) =
            ([low, high].map(|z| table.profile(z).0), [low, high].map(|z| table.profile(z).1));
        [
            0.5 * (high_profile - low_profile),
            (low_density - high_density) / spread,
            low * low_density - high * high_density,
        ]
    };
    let ([column, by_col, column_by_spread], [row, by_row, row_by_spread]) = (share(0), share(1));
    let light = parameters[1];
    let by_spread = light * (column_by_spread * row + column * row_by_spread);
    (
        parameters[0] + light * column * row,
        [1.0, column * row, light * by_col * row, light * column * by_row, by_spread],
    )
}

type Fitted = (Vec<f64>, SMatrix<f64, PARAMETERS, PARAMETERS>, f64);

/// Parameters, their covariance, sum of the squared residuals.
fn adjusted(
    pixels: &[([f64; 2], f64)],
    start: &[f64; PARAMETERS],
    sigma: f64,
) -> std::result::Result<Fitted, adjust::Error> {
    let mut network = Adjustment::new();
    let block = network.add_block(ParameterBlock::euclidean(start.as_slice()).named("light"));
    let group = network.add_group("pixels");
    for (pixel, observed) in pixels {
        let observation = FunctionObservation::new([block], 1, move |parameters, residual, jacobians| {
            let (modelled, derivatives) = value(parameters[0], *pixel);
            residual[0] = observed - modelled;
            if let Some(jacobians) = jacobians {
                jacobians.row(0, 0).copy_from_slice(&derivatives);
            }
            Ok(())
        });
        network.add_observation(group, observation, &Covariance::from_sigma(sigma))?;
    }
    let expectation = network.add_group("spread");
    let expected = LinearObservation::new(EXPECTED_SPREAD[0], [(block, vec![0.0, 0.0, 0.0, 0.0, 1.0])]);
    network.add_observation(expectation, expected, &Covariance::from_sigma(EXPECTED_SPREAD[1]))?;
    let options = SolveOptions { max_iterations: 40, step_tolerance: 1e-3, ..SolveOptions::default() };
    let solution = network.solve(&options)?;
    let whole = solution.covariance(block, Scale::Prior)?;
    let squares = solution.residuals().iter().take(pixels.len()).map(|residual| residual * residual).sum();
    Ok((solution.values(block)?.to_vec(), SMatrix::from_fn(|row, column| whole[(row, column)]), squares))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_are_those_of_differences() {
        let parameters = [3.0, 200.0, 10.3, 11.8, -0.2];
        for pixel in [[10.0, 12.0], [11.0, 10.0], [8.0, 13.0]] {
            let (_, derivatives) = value(&parameters, pixel);
            for k in 0..PARAMETERS {
                let at = |sign: f64| {
                    let mut moved = parameters;
                    moved[k] += sign * 1e-3;
                    value(&moved, pixel).0
                };
                let difference = (at(1.0) - at(-1.0)) / 2e-3;
                // The table is good to 3e-9 of 200, over a step of 1e-3; curvature adds the square of the step.
                assert!((derivatives[k] - difference).abs() < 2e-3 + 1e-4 * difference.abs(), "{pixel:?} {k}");
            }
        }
    }
}
