//! What the covariance of the calibration means for a point.

use camera_model::Camera;
use error_models::{ModelSet, RangeErrorModel};
use nalgebra::{DMatrix, DVector, Point3};
use range_io::calibration::Calibration;
use self_calibration::CalibrationOutcome;

use crate::Result;
use crate::report::colour::ColourMap;
use crate::report::picture::{Scale, raster_figure};
use crate::statistics::median;

/// Ranges of the maps, metre.
const RANGES_M: [f64; 3] = [1.0, 2.0, 4.0];
/// Columns of the maps; more would show the same smooth surface.
const COLUMNS: usize = 44;

/// A calibration whose points are asked for their uncertainty.
pub(crate) struct PointUncertainty<'a> {
    /// Interior orientation and lens.
    pub(crate) camera: &'a Camera,
    /// Range models; the first stands for all.
    pub(crate) range_models: &'a [(Option<f64>, RangeErrorModel)],
}

/// Camera and range model with one parameter moved by its standard deviation up and down.
type Moved = [(Camera, RangeErrorModel); 2];

impl PointUncertainty<'_> {
    /// Maps over the image of the standard deviation of a point, millimetre; empty where nothing was estimated.
    pub(crate) fn figures(
        &self,
        names: &[String],
        covariance: &DMatrix<f64>,
        amplitude: f64,
    ) -> Result<Vec<(String, String)>> {
        let format = self.camera.format;
        let rows = (COLUMNS * format.height).div_ceil(format.width.max(1)).max(1);
        let centre =
            |index: usize, count: usize, pixels: usize| (index as f64 + 0.5) * pixels as f64 / count as f64 - 0.5;
        let (moved, correlation) = self.moved(names, covariance);
        if moved.is_empty() {
            return Ok(Vec::new());
        }
        let span = self.range_models.first().and_then(|(_, model)| model.range_span_m);
        let mut figures = Vec::new();
        for range_m in RANGES_M {
            let mut values = Vec::with_capacity(COLUMNS * rows);
            for row in 0..rows {
                for column in 0..COLUMNS {
                    let pixel = [centre(column, COLUMNS, format.width), centre(row, rows, format.height)];
                    values.push(1e3 * point_sigma(&moved, &correlation, pixel, range_m, amplitude));
                }
            }
            figures.push(figure(range_m, &values, span)?);
        }
        Ok(figures)
    }

    /// Standard deviation of the correction at the principal point, for each range, metre.
    pub(crate) fn correction_sigmas(
        &self,
        names: &[String],
        covariance: &DMatrix<f64>,
        ranges_m: &[f64],
        amplitude: f64,
    ) -> Vec<f64> {
        let (moved, correlation) = self.moved(names, covariance);
        let sigma = |range_m: &f64| {
            let half = |pair: &Moved| {
                let [up, down] =
                    [&pair[0].1, &pair[1].1].map(|model| model.correction(*range_m, 0.0, 0.0, amplitude).total_m());
                (up - down) / 2.0
            };
            let effects = DVector::from_iterator(moved.len(), moved.iter().map(half));
            effects.dot(&(&correlation * &effects)).max(0.0).sqrt()
        };
        ranges_m.iter().map(sigma).collect()
    }

    /// The models with each parameter moved, and the correlations of those parameters. Parameters of further
    /// integration times have no effect on the first one's points and are left out.
    fn moved(&self, names: &[String], covariance: &DMatrix<f64>) -> (Vec<Moved>, DMatrix<f64>) {
        let mut moved = Vec::new();
        let mut kept = Vec::new();
        for (index, name) in names.iter().enumerate() {
            let sigma = covariance[(index, index)].sqrt();
            let pair = [self.with(name, sigma), self.with(name, -sigma)];
            if let [Some(up), Some(down)] = pair
                && sigma > 0.0
            {
                moved.push([up, down]);
                kept.push((index, sigma));
            }
        }
        let element = |i: usize, j: usize| {
            let ((a, sigma_a), (b, sigma_b)) = (kept[i], kept[j]);
            covariance[(a, b)] / (sigma_a * sigma_b)
        };
        let correlation = DMatrix::from_fn(kept.len(), kept.len(), element);
        (moved, correlation)
    }

    /// Camera and range model with one parameter moved; `None` where neither has it or the result is no model.
    fn with(&self, name: &str, change: f64) -> Option<(Camera, RangeErrorModel)> {
        let model = self.range_models.first().map(|(_, model)| model.clone());
        let entries = model.iter().map(|model| (1.0, vec![model.clone()])).collect();
        let mut file = Calibration::from_models(self.camera, &ModelSet { entries }, None).ok()?;
        let ranges = file.range_models.iter_mut().flat_map(|model| &mut model.parameters);
        let parameter = file.parameters.iter_mut().chain(ranges).find(|parameter| parameter.name == name)?;
        parameter.value += change;
        let moved = file.range_models.first().and_then(|model| model.to_model().ok())?;
        // Where a point lies outside the span of the fit, its uncertainty is that of the extrapolation.
        Some((file.camera().ok()?, RangeErrorModel { range_span_m: None, ..moved }))
    }
}

/// Standard deviation of a point in space, metre: half the difference of the moved points stands for derivative times
/// standard deviation.
fn point_sigma(moved: &[Moved], correlation: &DMatrix<f64>, pixel: [f64; 2], range_m: f64, amplitude: f64) -> f64 {
    let point = |(camera, model): &(Camera, RangeErrorModel)| -> Point3<f64> {
        let [x, y] = camera.format.image_from_pixel(pixel);
        let [xp, yp] = camera.interior.principal_point_mm;
        camera.point(pixel, model.corrected_range(range_m, x - xp, y - yp, amplitude))
    };
    let effects: Vec<_> = moved.iter().map(|[up, down]| (point(up) - point(down)) / 2.0).collect();
    let mut variance = 0.0;
    for (i, a) in effects.iter().enumerate() {
        for (j, b) in effects.iter().enumerate() {
            variance += correlation[(i, j)] * a.dot(b);
        }
    }
    variance.max(0.0).sqrt()
}

fn figure(range_m: f64, values: &[f64], span: Option<[f64; 2]>) -> Result<(String, String)> {
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    let high = finite().fold(0.0, f64::max);
    let scale = Scale { map: ColourMap::Sequential, low: 0.0, high, unit: "mm" };
    let svg = raster_figure(&format!("At {range_m} m"), COLUMNS, values, &scale)?;
    let outside = match span {
        Some([low, high]) if !(low..=high).contains(&range_m) => {
            format!(" Outside the ranges observed ({low:.2} m to {high:.2} m): extrapolated.")
        }
        _ => String::new(),
    };
    let caption = format!("Median {:.2} mm, at most {high:.2} mm.{outside}", median(&mut finite().collect::<Vec<_>>()));
    Ok((svg, caption))
}

/// The median amplitude of the ranges observed; NaN where none is known, which leaves the hyperbola out.
pub(crate) fn amplitude_of(outcome: &CalibrationOutcome) -> f64 {
    median(&mut outcome.residuals.iter().map(|quality| quality.amplitude).collect::<Vec<_>>())
}
