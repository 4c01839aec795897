//! Least squares for one corner.

use nalgebra::{Matrix2, SMatrix, SVector, Vector2};

use super::crossing::{Crossing, Parameters};
use super::window::{Expected, Pixel};

type Normal = SMatrix<f64, 9, 9>;

/// Most steps of the iteration; from where saddles lie, five or six do.
const MOST_STEPS: usize = 20;

/// A step of the corner below which the iteration ends, pixel: a hundredth of what the best images give.
const SMALL_STEP: f64 = 1e-4;

/// Pixels that a window holds at least: the corner is settled by fewer only with what is known beforehand.
const LEAST_PIXELS: usize = 14;

/// Blur of optics and pixels beforehand, pixel, and the least: a pixel's own width is 1/√12 of one.
const BLUR: f64 = 0.9;
const LEAST_BLUR: f64 = 0.25;

/// What is known of parameters beforehand, as the deviations from their start: directions of the edges from those of the
/// grid, radian (a field's side bends that much in the widest lens), the blur, pixel, and the slope of the light, per pixel
/// (one that halves over 25). Without, windows of 25 pixels would not settle them.
const KNOWN: [(usize, f64); 5] = [(2, 0.1), (3, 0.1), (4, 0.6), (7, 0.02), (8, 0.02)];

/// A corner by least squares.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fitted {
    pub(super) position: Vector2<f64>,
    /// Of the position, for noise of the deviation that was given.
    pub(super) covariance: Matrix2<f64>,
    parameters: Parameters,
    /// Deviation of the half contrast, for noise as given.
    pub(super) contrast_deviation: f64,
    /// Mean square of the residuals per degree of freedom, and how many of those.
    pub(super) variance: f64,
    pub(super) freedom: f64,
}

impl Fitted {
    /// Half the difference of bright and dark; positive where the field between both steps is bright.
    pub(super) fn contrast(&self) -> f64 {
        self.parameters[6]
    }

    /// Blur of the edges, pixel.
    pub(super) fn blur_px(&self) -> f64 {
        self.parameters[4]
    }

    /// Its parameters about the middle of another window.
    fn about(&self, expected: &Expected) -> Parameters {
        let mut parameters = self.parameters;
        let corner = self.position - expected.middle();
        parameters[..2].copy_from_slice(corner.as_slice());
        parameters
    }
}

/// What is fitted.
pub(super) struct Problem<'a> {
    pub(super) crossing: Crossing<'a>,
    pub(super) pixels: &'a [Pixel],
    /// Deviation of the noise.
    pub(super) noise: f64,
    /// Value at which the sensor saturates; infinite if it does not.
    pub(super) plateau: f64,
}

/// Sums over the pixels at some parameters.
struct Sums {
    normal: Normal,
    right: SVector<f64, 9>,
    /// Of squared residuals in units of the noise, and with those of what is known beforehand.
    squares: f64,
    cost: f64,
    /// Pixels below the plateau.
    count: usize,
}

impl<'a> Problem<'a> {
    /// The same corner from other pixels of its window.
    pub(super) fn with_pixels<'b>(&'b self, pixels: &'b [Pixel]) -> Problem<'b>
    where
        'a: 'b,
    {
        let crossing = Crossing { table: self.crossing.table, spans: self.crossing.spans };
        Problem { crossing, pixels, noise: self.noise, plateau: self.plateau }
    }

    /// Residuals of all pixels at a corner of the same window, unit of the image.
    pub(super) fn residuals(&self, fitted: &Fitted) -> Vec<f64> {
        let edges = self.crossing.with(&fitted.parameters);
        let residual = |pixel: &Pixel| pixel.value - edges.value(pixel.place, pixel.bend).0.min(self.plateau);
        self.pixels.iter().map(residual).collect()
    }

    /// The corner near where it is expected, beginning at an earlier fit if there is one; `None` where the pixels do not
    /// settle one.
    pub(super) fn fit(&self, expected: &Expected, sign: f64, earlier: Option<&Fitted>) -> Option<Fitted> {
        if self.pixels.len() < LEAST_PIXELS {
            return None;
        }
        let start = self.start(expected, sign)?;
        let mut parameters = earlier.map_or(start, |earlier| earlier.about(expected));
        let mut sums = self.sums(&parameters, &start);
        let mut damping = 1e-3;
        for _ in 0..MOST_STEPS {
            let mut damped = sums.normal;
            damped.set_diagonal(&(sums.normal.diagonal() * (1.0 + damping)));
            let step = damped.cholesky()?.solve(&sums.right);
            let mut next = parameters;
            next.iter_mut().zip(step.iter()).for_each(|(parameter, step)| *parameter += step);
            next[4] = next[4].max(LEAST_BLUR);
            let tried = self.sums(&next, &start);
            if tried.cost <= sums.cost {
                (parameters, sums) = (next, tried);
                damping *= 0.1;
                if step[0].abs() + step[1].abs() < SMALL_STEP {
                    break;
                }
            } else if tried.cost.is_finite() && damping < 1e6 {
                damping *= 10.0;
            } else {
                return None;
            }
        }
        self.fitted(&parameters, &sums, expected)
    }

    /// Directions by the grid, levels by the sign of the pattern there.
    fn start(&self, expected: &Expected, sign: f64) -> Option<Parameters> {
        let [first, second] = expected.normals()?.map(|normal| normal.y.atan2(normal.x));
        let middle = expected.position - expected.middle();
        let mut start = [middle.x, middle.y, first, second, BLUR, 0.0, 1.0, 0.0, 0.0];
        let edges = self.crossing.with(&start);
        let patterns = self.pixels.iter().map(|pixel| (edges.value(pixel.place, pixel.bend).0, pixel.value));
        let sums = patterns.fold([0.0; 4], |[s, ss, v, sv], (pattern, value)| {
            [s + pattern, ss + pattern * pattern, v + value, sv + pattern * value]
        });
        let count = self.pixels.len() as f64;
        let [pattern, squared, value, product] = sums.map(|sum| sum / count);
        let contrast = (product - pattern * value) / (squared - pattern * pattern);
        start[5] = value - contrast * pattern;
        start[6] = contrast;
        // Also of no number.
        (contrast * sign > 0.0).then_some(start)
    }

    fn sums(&self, parameters: &Parameters, start: &Parameters) -> Sums {
        let mut sums = Sums { normal: Normal::zeros(), right: SVector::zeros(), squares: 0.0, cost: 0.0, count: 0 };
        let weight = 1.0 / (self.noise * self.noise);
        let edges = self.crossing.with(parameters);
        for pixel in self.pixels {
            let (value, derivatives) = edges.value(pixel.place, pixel.bend);
            // What a saturated pixel would have seen is not known, but that it is no less than the plateau.
            let beyond = value >= self.plateau;
            let residual = pixel.value - value.min(self.plateau);
            sums.squares += weight * residual * residual;
            if beyond {
                continue;
            }
            sums.count += 1;
            let row = SVector::<f64, 9>::from(derivatives);
            sums.normal.ger(weight, &row, &row, 1.0);
            sums.right.axpy(weight * residual, &row, 1.0);
        }
        sums.cost = sums.squares;
        for (k, deviation) in KNOWN {
            let weight = 1.0 / (deviation * deviation);
            let residual = start[k] - parameters[k];
            sums.normal[(k, k)] += weight;
            sums.right[k] += weight * residual;
            sums.cost += weight * residual * residual;
        }
        sums
    }

    fn fitted(&self, parameters: &Parameters, sums: &Sums, expected: &Expected) -> Option<Fitted> {
        let covariance = sums.normal.cholesky()?.inverse();
        // Parameters that are known beforehand take a part of a degree of freedom only.
        let settled_before: f64 =
            KNOWN.iter().map(|&(k, deviation)| covariance[(k, k)] / (deviation * deviation)).sum();
        let freedom = sums.count as f64 - parameters.len() as f64 + settled_before;
        let position = expected.middle() + Vector2::new(parameters[0], parameters[1]);
        let block = covariance.fixed_view::<2, 2>(0, 0).into_owned();
        let fitted = Fitted {
            position,
            covariance: block,
            parameters: *parameters,
            contrast_deviation: covariance[(6, 6)].sqrt(),
            variance: sums.squares * self.noise * self.noise / freedom.max(1.0),
            freedom,
        };
        let valid = position.iter().chain(block.iter()).all(|value| value.is_finite()) && freedom >= 1.0;
        valid.then_some(fitted)
    }
}
