//! The disc adjusted to the pixels about it.

use adjust::{Adjustment, Covariance, FunctionObservation, LinearObservation, ParameterBlock, Scale, SolveOptions};
use nalgebra::{Matrix2, Matrix5};
use range_image::Raster;

use super::disc_model::{BLUR, CENTRE, CONTRAST, DiscModel, PARAMETERS, SMOOTH_PX, blur_px};
use super::ellipse::Ellipse;
use super::rough_fit::{Look, Rough};
use crate::image::normal_table::NormalTable;

/// Ground that takes part about the disc, in parts of its mean radius and pixel: enough to know its level, and not the next dot.
const GROUND_PARTS: f64 = 0.5;
const GROUND_PX: [f64; 2] = [2.5, 6.0];
/// What lies deeper inside than this says nothing of the edge, pixel; of large discs it is left out, as light is not a plane there.
const DEPTH_PX: f64 = 8.0;
/// Mean radius below which a slope inside and a shift of the centre look alike, pixel.
const SMALLEST_WITH_SLOPE_PX: f64 = 4.0;
/// β that is expected and its deviation, pixel: a weak prior that only holds the blur of sharp images, whose edge lies within a
/// pixel.
pub(crate) const EXPECTED_BLUR: [f64; 2] = [0.3, 1.0];
/// Noise that is taken for granted, in parts of the contrast: rounding of values, and what the model leaves out.
const LEAST_NOISE_PARTS: f64 = 1e-3;
/// Share of the window that must have values.
const LEAST_SHARE: f64 = 0.6;

/// More steps than a disc ever takes; what needs them is none.
const MOST_STEPS: usize = 15;
/// Pixels of one observation: of single ones the bookkeeping takes as long as the model.
const TOGETHER: usize = 8;
/// The end of the iteration in standard deviations: a tenth of one adds a hundredth to the variance, and steps of a disc shrink tenfold each.
const TOLERANCE: f64 = 0.1;

/// A disc that was fitted. Contrast is positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DiscFit {
    pub(crate) ellipse: Ellipse,
    /// Of col, row, semi-axes, direction; scaled by sigma0².
    pub(crate) covariance: Matrix5<f64>,
    pub(crate) contrast: f64,
    pub(crate) level: f64,
    pub(crate) blur_px: f64,
    /// Standard deviation of unit weight.
    pub(crate) sigma0: f64,
    /// Root mean square of the residuals beside the noise, in parts of the contrast.
    pub(crate) misfit: f64,
}

impl DiscFit {
    /// What tells whether it is a disc.
    pub(crate) fn look(&self) -> Look {
        let Self { ellipse, contrast, blur_px, misfit, .. } = *self;
        Look { ellipse, contrast, blur_px, misfit }
    }
}

/// The pixels about a disc that say where it is.
pub(crate) struct Window {
    pub(crate) pixels: Vec<([f64; 2], f64)>,
}

impl Window {
    /// Pixels about an ellipse, those for which `foreign(col, row)` holds left out. `None` where too few have values.
    pub(crate) fn about(
        image: &Raster<f32>,
        ellipse: &Ellipse,
        foreign: impl Fn(usize, usize) -> bool,
    ) -> Option<Self> {
        let matrix = ellipse.to_unit_circle();
        let ground = (GROUND_PARTS * ellipse.mean_radius_px()).clamp(GROUND_PX[0], GROUND_PX[1]);
        let reach = ellipse.semi_axes_px[0] + ground;
        let range = |centre: f64, size: usize| {
            let (first, last) = ((centre - reach).ceil().max(0.0), (centre + reach).floor().min(size as f64 - 1.0));
            first as usize..(last + 1.0).max(0.0) as usize
        };
        let (mut pixels, mut looked_at) = (Vec::new(), 0_usize);
        for row in range(ellipse.centre[1], image.height()) {
            for col in range(ellipse.centre[0], image.width()) {
                let pixel = [col as f64, row as f64];
                let off = signed_distance(ellipse, &matrix, pixel);
                if !(-DEPTH_PX..=ground).contains(&off) || foreign(col, row) {
                    continue;
                }
                looked_at += 1;
                let value = f64::from(image[(col, row)]);
                if value.is_finite() {
                    pixels.push((pixel, value));
                }
            }
        }
        let enough = pixels.len() >= 2 * PARAMETERS && pixels.len() as f64 >= LEAST_SHARE * looked_at as f64;
        enough.then_some(Self { pixels })
    }
}

/// Distance to an ellipse to first order, negative inside.
fn signed_distance(ellipse: &Ellipse, matrix: &Matrix2<f64>, pixel: [f64; 2]) -> f64 {
    let q = matrix * nalgebra::Vector2::new(pixel[0] - ellipse.centre[0], pixel[1] - ellipse.centre[1]);
    let parts = q.norm();
    if parts > 0.0 { (parts - 1.0) * parts / (matrix * q).norm() } else { -ellipse.semi_axes_px[1] }
}

/// Deviation of a pixel's noise that is taken for granted.
pub(crate) fn least_noise(noise: f64, contrast: f64) -> f64 {
    noise.max(LEAST_NOISE_PARTS * contrast)
}

/// The disc of the window, brighter than its ground, from a first fit on; `None` where the iteration finds none.
/// `noise` is the standard deviation of a pixel.
pub(crate) fn fit(window: &Window, first: &Rough, noise: f64) -> Option<DiscFit> {
    let Look { ellipse: start, contrast, .. } = first.look;
    // What has less than the noise of two pixels is none.
    if contrast.is_nan() || contrast <= 2.0 * noise {
        return None;
    }
    let sigma = least_noise(noise, contrast);
    // Pixels scatter by what the model leaves out as well: beside that the iteration need not settle.
    let scatter = sigma.hypot(first.look.misfit * contrast);
    let (model, values) =
        (DiscModel { origin: start.centre, is_smooth: first.look.blur_px >= SMOOTH_PX }, first.parameters);
    let held = |held: &[usize]| adjusted(window, model, &values, scatter, held);
    let small = start.mean_radius_px() < SMALLEST_WITH_SLOPE_PX;
    let slopes: &[usize] = if small { &[CONTRAST + 1, CONTRAST + 2] } else { &[] };
    // An edge that a camera sharpened has no blur that the iteration could settle on.
    let (values, covariance, squares) = held(slopes).or_else(|_| held(&[slopes, &[BLUR]].concat())).ok()?;
    let ellipse = Ellipse::from_unit_circle([values[CENTRE], values[CENTRE + 1]], [values[8], values[9], values[10]]);
    let count = window.pixels.len() as f64;
    let redundancy = count - PARAMETERS as f64;
    let contrast = values[CONTRAST];
    let variance = squares / redundancy;
    let beside_noise = (variance - sigma * sigma).max(0.0).sqrt();
    let good = contrast > 0.0 && ellipse.semi_axes_px.iter().all(|axis| axis.is_finite() && *axis > 0.0);
    good.then(|| DiscFit {
        covariance: ellipse
            .covariance([values[8], values[9], values[10]], &(covariance * (variance / (scatter * scatter)))),
        ellipse,
        contrast,
        level: values[0],
        blur_px: blur_px(&values),
        sigma0: variance.sqrt() / sigma,
        misfit: beside_noise / contrast,
    })
}

/// Parameters, covariance of centre and shape, sum of the squared residuals.
fn adjusted(
    window: &Window,
    model: DiscModel,
    start: &[f64; PARAMETERS],
    sigma: f64,
    held: &[usize],
) -> Result<(Vec<f64>, Matrix5<f64>, f64), adjust::Error> {
    let mut network = Adjustment::new();
    let block = network.add_block(ParameterBlock::euclidean(start.as_slice()).named("disc"));
    let group = network.add_group("pixels");
    let table = NormalTable::new();
    for pixels in window.pixels.chunks(TOGETHER) {
        let observation =
            FunctionObservation::new([block], pixels.len(), move |parameters, residual, mut jacobians| {
                for (row, (pixel, value)) in pixels.iter().enumerate() {
                    let (modelled, derivatives) = model.value(&table, parameters[0], *pixel);
                    residual[row] = value - modelled;
                    if let Some(jacobians) = &mut jacobians {
                        jacobians.row(0, row).copy_from_slice(&derivatives);
                    }
                }
                Ok(())
            });
        network.add_observation(group, observation, &Covariance::from_sigmas(&[sigma; TOGETHER][..pixels.len()]))?;
    }
    let expectation = network.add_group("blur");
    let mut row = [0.0; PARAMETERS];
    row[BLUR] = 1.0;
    let expected = LinearObservation::new(EXPECTED_BLUR[0], [(block, row.to_vec())]);
    network.add_observation(expectation, expected, &Covariance::from_sigma(EXPECTED_BLUR[1]))?;
    for parameter in held {
        network.hold_parameter(block, *parameter)?;
    }
    let options = SolveOptions { max_iterations: MOST_STEPS, step_tolerance: TOLERANCE, ..SolveOptions::default() };
    let solution = network.solve(&options)?;
    let values = solution.values(block)?.to_vec();
    let whole = solution.covariance(block, Scale::Prior)?;
    let covariance = Matrix5::from_fn(|row, column| whole[(CENTRE + row, CENTRE + column)]);
    let squares = solution.residuals().iter().take(window.pixels.len()).map(|residual| residual * residual).sum();
    Ok((values, covariance, squares))
}
