//! What the covariance of the calibration means for a point.

use camera_model::Camera;
use error_models::{ModelSet, RangeErrorModel};
use nalgebra::{DMatrix, DVector, Point3, Vector4};
use range_io::calibration::Calibration;
use self_calibration::CalibrationOutcome;
use statistics::quantile;

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
    /// Standard deviation of the correction at the principal point, for each range, metre.
    pub(crate) fn correction_sigmas(
        &self,
        names: &[String],
        covariance: &DMatrix<f64>,
        ranges_m: &[f64],
        amplitude: f64,
    ) -> Vec<f64> {
        let moved = self.moved(names, covariance);
        let sigma = |range_m: &f64| moved.sigma_of(|model| model.correction(*range_m, 0.0, 0.0, amplitude).total_m());
        ranges_m.iter().map(sigma).collect()
    }

    /// The models with each parameter moved, and the correlations of those parameters. Parameters of further
    /// integration times have no effect on the first one's points and are left out.
    pub(crate) fn moved(&self, names: &[String], covariance: &DMatrix<f64>) -> MovedCalibration {
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
        MovedCalibration { moved, correlation }
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

/// Standard deviations, metre, that a calibration alone gives to what is measured at a place.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlaceSigma {
    /// Of the corrected range.
    pub(crate) range_m: f64,
    /// Of the point in space: the root of the trace of its covariance.
    pub(crate) point_m: f64,
}

/// The calibration with each parameter moved by its standard deviation up and down, and the correlations of these.
pub(crate) struct MovedCalibration {
    moved: Vec<Moved>,
    correlation: DMatrix<f64>,
}

impl MovedCalibration {
    /// Whether nothing was estimated.
    pub(crate) fn is_empty(&self) -> bool {
        self.moved.is_empty()
    }

    /// Standard deviation of a quantity of the range model: half the difference of what was moved stands for derivative times
    /// standard deviation.
    pub(crate) fn sigma_of(&self, quantity: impl Fn(&RangeErrorModel) -> f64) -> f64 {
        let half = |pair: &Moved| (quantity(&pair[0].1) - quantity(&pair[1].1)) / 2.0;
        let effects = DVector::from_iterator(self.moved.len(), self.moved.iter().map(half));
        effects.dot(&(&self.correlation * &effects)).max(0.0).sqrt()
    }

    /// Standard deviations at a pixel (column, row), a range in metre and an amplitude: half the difference of what was moved
    /// stands for derivative times standard deviation.
    pub(crate) fn at(&self, pixel: [f64; 2], range_m: f64, amplitude: f64) -> PlaceSigma {
        let corrected = |(camera, model): &(Camera, RangeErrorModel)| {
            let [x, y] = camera.format.image_from_pixel(pixel);
            let [xp, yp] = camera.interior.principal_point_mm;
            model.corrected_range(range_m, x - xp, y - yp, amplitude)
        };
        let point = |of: &(Camera, RangeErrorModel)| -> Point3<f64> { of.0.point(pixel, corrected(of)) };
        let effects: Vec<Vector4<f64>> = self
            .moved
            .iter()
            .map(|[up, down]| {
                let half = (point(up) - point(down)) / 2.0;
                Vector4::new(half.x, half.y, half.z, (corrected(up) - corrected(down)) / 2.0)
            })
            .collect();
        let (mut of_range, mut of_point) = (0.0, 0.0);
        for (i, a) in effects.iter().enumerate() {
            for (j, b) in effects.iter().enumerate() {
                let correlation = self.correlation[(i, j)];
                of_range += correlation * a.w * b.w;
                of_point += correlation * a.xyz().dot(&b.xyz());
            }
        }
        PlaceSigma { range_m: of_range.max(0.0).sqrt(), point_m: of_point.max(0.0).sqrt() }
    }
}

/// The median amplitude of the ranges observed; NaN where none is known, which leaves the hyperbola out.
pub(crate) fn amplitude_of(outcome: &CalibrationOutcome) -> f64 {
    quantile(&mut outcome.residuals.iter().map(|quality| quality.amplitude).collect::<Vec<_>>(), 0.5)
}
