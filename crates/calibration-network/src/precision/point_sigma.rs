//! What the uncertainty of a calibration means for points.

use nalgebra::{DMatrix, Vector3};

use crate::functional_model::setup::Calibration;
use crate::functional_model::terms::{
    camera_from, camera_names, camera_values, range_model_from, range_names, range_values,
};
use crate::precision::report::Estimate;

/// What the covariance of the calibration means for a point at a range: differences of the points that the calibration
/// makes of one observation, over a grid of image points.
pub fn point_sigma(calibration: &Calibration, estimate: &Estimate, range_m: f64) -> f64 {
    const GRID: usize = 5;
    let format = calibration.camera.format;
    let at = |index: usize, size: usize| (index as f64 + 0.5) / GRID as f64 * size as f64 - 0.5;
    let mut sum = 0.0;
    for index in 0..GRID * GRID {
        let pixel = [at(index % GRID, format.width), at(index / GRID, format.height)];
        let columns: Vec<Vector3<f64>> =
            estimate.names.iter().map(|name| derivative(calibration, name, pixel, range_m)).collect();
        let jacobian = DMatrix::from_fn(3, columns.len(), |row, column| columns[column][row]);
        sum += (&jacobian * &estimate.first_order * jacobian.transpose()).trace();
    }
    (sum / (GRID * GRID) as f64).sqrt()
}

/// Derivative of a corrected point with respect to a calibration parameter, by central differences. Terms of another
/// integration time than the first do not act on it.
fn derivative(calibration: &Calibration, name: &str, pixel: [f64; 2], range_m: f64) -> Vector3<f64> {
    let Some(set) = calibration.sets.first() else { return Vector3::zeros() };
    let point = |camera: &camera_model::Camera, model: &error_models::RangeErrorModel| {
        let [x, y] = camera.format.image_from_pixel(pixel);
        let [xp, yp] = camera.interior.principal_point_mm;
        let amplitude = model.hyperbola.map_or(f64::NAN, |h| f64::midpoint(h.amplitude_span[0], h.amplitude_span[1]));
        camera.point(pixel, model.corrected_range(range_m, x - xp, y - yp, amplitude)).coords
    };
    // Small against every parameter's own size, large against rounding.
    let step = 1e-6;
    let moved = |mut values: Vec<f64>, component: usize, step: f64| {
        values[component] += step;
        values
    };
    if let Some(component) = camera_names().iter().position(|known| *known == name) {
        let camera =
            |step| camera_from(&calibration.camera, &moved(camera_values(&calibration.camera), component, step));
        let (Some(ahead), Some(behind)) = (camera(step), camera(-step)) else { return Vector3::zeros() };
        return (point(&ahead, &set.model) - point(&behind, &set.model)) / (2.0 * step);
    }
    let Some(component) = range_names(&set.model).iter().position(|known| known == name) else {
        return Vector3::zeros();
    };
    let model = |step| range_model_from(&set.model, &moved(range_values(&set.model), component, step));
    (point(&calibration.camera, &model(step)) - point(&calibration.camera, &model(-step))) / (2.0 * step)
}
