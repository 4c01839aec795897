//! A first fit of a disc, which most of what is no disc does not survive, and the start of the fit of [`super::disc_fit`].
//!
//! The model is that of [`super::disc_model`] with a pixel for a point (its own variance goes to the blur) and with one contrast and
//! a level whose slope is taken off beforehand: eight unknowns, and one place of a pixel in place of nine.

use nalgebra::{Matrix4, SMatrix, SVector, Vector4};

use super::disc_fit::{EXPECTED_BLUR, Window, least_noise};
use super::disc_model::{BLUR, CENTRE, PARAMETERS, SHAPE, blur_px, inside_at_point};
use super::ellipse::Ellipse;
use crate::image::normal_table::NormalTable;

/// Level, contrast, centre, shape and β.
const UNKNOWNS: usize = 8;
/// Their places among the parameters of the model; the contrast stands at 1 here.
const PLACES: [usize; UNKNOWNS] = [0, 1, CENTRE, CENTRE + 1, SHAPE, SHAPE + 1, SHAPE + 2, BLUR];
/// Most steps: blurred discs take five or six.
const MOST_STEPS: usize = 15;
/// Part of the sum of squares below which a step gains nothing.
const SMALL_GAIN: f64 = 1e-3;

/// What tells whether a fit is a disc.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Look {
    pub(crate) ellipse: Ellipse,
    pub(crate) contrast: f64,
    pub(crate) blur_px: f64,
    /// Root mean square of the residuals beside the noise, in parts of the contrast.
    pub(crate) misfit: f64,
}

/// A disc, roughly.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rough {
    pub(crate) look: Look,
    /// Parameters of the model, slopes counted from the centre.
    pub(crate) parameters: [f64; PARAMETERS],
}

struct Sums {
    normal: SMatrix<f64, UNKNOWNS, UNKNOWNS>,
    right: SVector<f64, UNKNOWNS>,
    /// Of squared residuals, and with that of what is expected of β.
    squares: f64,
    cost: f64,
}

/// The disc of a window near an ellipse, brighter than its ground. `noise`: the deviation of a pixel.
pub(crate) fn rough_fit(window: &Window, start: &Ellipse, noise: f64) -> Option<Rough> {
    let matrix = start.to_unit_circle();
    let mut values = [0.0; PARAMETERS];
    values[CENTRE..SHAPE].copy_from_slice(&start.centre);
    values[SHAPE..BLUR].copy_from_slice(&[matrix.m11, matrix.m12, matrix.m22]);
    values[BLUR] = EXPECTED_BLUR[0];
    let fit = Fit { table: NormalTable::new(), window, sigma: noise, slopes: [0.0; 2], origin: start.centre };
    let [level, contrast, slopes @ ..] = fit.linear(&values)?;
    let sigma = least_noise(noise, contrast);
    let fit = Fit { sigma, slopes, ..fit };
    (values[0], values[1]) = (level, contrast);
    let (values, squares) = fit.settled(values)?;
    let ellipse = Ellipse::from_unit_circle([values[CENTRE], values[CENTRE + 1]], [values[8], values[9], values[10]]);
    let scatter = squares / (window.pixels.len() - UNKNOWNS) as f64;
    let good = values[1] > 0.0 && ellipse.semi_axes_px.iter().all(|axis| axis.is_finite() && *axis > 0.0);
    let mut parameters = values;
    let [x, y] = [0, 1].map(|axis| ellipse.centre[axis] - fit.origin[axis]);
    parameters[..CENTRE].copy_from_slice(&[
        values[0] + fit.slopes[0] * x + fit.slopes[1] * y,
        fit.slopes[0],
        fit.slopes[1],
        values[1],
        0.0,
        0.0,
    ]);
    let look = Look {
        ellipse,
        contrast: values[1],
        blur_px: blur_px(&values),
        misfit: (scatter - 1.0).max(0.0).sqrt() * sigma / values[1],
    };
    good.then_some(Rough { look, parameters })
}

struct Fit<'a> {
    table: NormalTable,
    window: &'a Window,
    sigma: f64,
    /// Of the level, per pixel, from the origin on.
    slopes: [f64; 2],
    origin: [f64; 2],
}

impl Fit<'_> {
    /// Level, contrast and slopes for an ellipse; `None` where the pixels do not tell them, or the disc is not the brighter.
    fn linear(&self, values: &[f64; PARAMETERS]) -> Option<[f64; 4]> {
        let (mut normal, mut right) = (Matrix4::zeros(), Vector4::zeros());
        for (pixel, value) in &self.window.pixels {
            let (inside, _) = inside_at_point(&self.table, values, *pixel);
            let row = Vector4::new(1.0, inside, pixel[0] - self.origin[0], pixel[1] - self.origin[1]);
            normal.ger(1.0, &row, &row, 1.0);
            right.axpy(*value, &row, 1.0);
        }
        let solved: [f64; 4] = normal.cholesky()?.solve(&right).into();
        // Also of no number.
        (solved[1] > 0.0).then_some(solved)
    }

    /// The parameters from where no step gains anything, or after many, and the sum of the squared residuals.
    fn settled(&self, mut values: [f64; PARAMETERS]) -> Option<([f64; PARAMETERS], f64)> {
        let mut sums = self.sums(&values);
        let mut damping = 1e-3;
        for _ in 0..MOST_STEPS {
            let mut damped = sums.normal;
            damped.set_diagonal(&(sums.normal.diagonal() * (1.0 + damping)));
            let step = damped.cholesky()?.solve(&sums.right);
            let mut next = values;
            PLACES.iter().zip(step.iter()).for_each(|(place, step)| next[*place] += step);
            let tried = self.sums(&next);
            if tried.cost <= sums.cost {
                let gain = sums.cost - tried.cost;
                (values, sums) = (next, tried);
                damping *= 0.1;
                if gain <= SMALL_GAIN * sums.cost {
                    return Some((values, sums.squares));
                }
            } else if tried.cost.is_finite() && damping < 1e6 {
                damping *= 10.0;
            } else {
                return None;
            }
        }
        // An edge without blur creeps on for ever.
        Some((values, sums.squares))
    }

    fn sums(&self, values: &[f64; PARAMETERS]) -> Sums {
        let mut sums = Sums { normal: SMatrix::zeros(), right: SVector::zeros(), squares: 0.0, cost: 0.0 };
        let (level, contrast, weight) = (values[0], values[1], 1.0 / (self.sigma * self.sigma));
        for (pixel, value) in &self.window.pixels {
            let (inside, by) = inside_at_point(&self.table, values, *pixel);
            let slope = self.slopes[0] * (pixel[0] - self.origin[0]) + self.slopes[1] * (pixel[1] - self.origin[1]);
            let residual = value - slope - level - contrast * inside;
            sums.squares += weight * residual * residual;
            let mut row = [1.0, inside, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
            row[2..].iter_mut().zip(by).for_each(|(out, by)| *out = contrast * by);
            for (i, first) in row.iter().enumerate() {
                let weighted = weight * first;
                sums.right[i] += weighted * residual;
                for (j, second) in row[..=i].iter().enumerate() {
                    sums.normal[(i, j)] += weighted * second;
                }
            }
        }
        for i in 0..UNKNOWNS {
            for j in 0..i {
                sums.normal[(j, i)] = sums.normal[(i, j)];
            }
        }
        let [expected, deviation] = EXPECTED_BLUR;
        let (off, weight) = (expected - values[BLUR], 1.0 / (deviation * deviation));
        sums.normal[(UNKNOWNS - 1, UNKNOWNS - 1)] += weight;
        sums.right[UNKNOWNS - 1] += weight * off;
        sums.cost = sums.squares + weight * off * off;
        sums
    }
}
