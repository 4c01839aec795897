//! The image point that a camera observes of a point in its frame: the fixed point of Eqs. 4, 5 and 8-13.

use adjust::EvaluationFailure;
use camera_model::{Camera, LensDistortion};
use nalgebra::{Matrix2, Matrix2x3, Vector2, Vector3};

use super::terms::camera_from;

/// An image point in pixel, modelled from a point of the camera frame and the camera's block.
pub(crate) struct ImageModel {
    pub(crate) pixel: [f64; 2],
    pub(crate) by_camera_point: Matrix2x3<f64>,
    /// Derivatives with respect to the camera's block, a row each for column and row.
    pub(crate) by_camera: [Vec<f64>; 2],
}

/// The solution of `x = xp − c·U/W + dx(x, y)`, in pixels.
pub(crate) fn image_model(
    template: &Camera,
    values: &[f64],
    point: &Vector3<f64>,
    derivatives: bool,
) -> Result<ImageModel, EvaluationFailure> {
    let camera = camera_from(template, values).ok_or_else(|| EvaluationFailure::new("a camera of the wrong length"))?;
    if point.z.is_nan() || point.z >= 0.0 {
        return Err(EvaluationFailure::new("the target lies behind the camera"));
    }
    let [xp, yp] = camera.interior.principal_point_mm;
    let scale = -camera.interior.principal_distance_mm / point.z;
    let corrected = Vector2::new(xp + scale * point.x, yp + scale * point.y);
    let (image, by_corrected) = observed_point(&camera, corrected)
        .ok_or_else(|| EvaluationFailure::new("the lens has no image of the target: its distortion folds over"))?;
    let pixel = camera.format.pixel_from_image(image);
    let [pitch_x, pitch_y] = camera.format.pixel_pitch_mm;
    let per_pixel = [1.0 / pitch_x, -1.0 / pitch_y];
    let mut model = ImageModel { pixel, by_camera_point: Matrix2x3::zeros(), by_camera: [Vec::new(), Vec::new()] };
    if !derivatives {
        return Ok(model);
    }
    let [u, v] = [point.x / point.z, point.y / point.z];
    let by_point = by_corrected * Matrix2x3::new(scale, 0.0, -scale * u, 0.0, scale, -scale * v);
    let design = by_corrected * LensDistortion::correction_design(&camera.interior, image);
    let by_distance = by_corrected * Vector2::new(-u, -v);
    for axis in 0..2 {
        // Counted from the principal point nothing depends on it.
        let along = |other: usize| if axis == other { 1.0 } else { 0.0 };
        let interior = [along(0), along(1), by_distance[axis]];
        let lens = (0..design.ncols()).map(|column| design[(axis, column)]);
        let row = interior.into_iter().chain(lens);
        model.by_camera[axis] = row.map(|derivative| derivative * per_pixel[axis]).collect();
        model.by_camera_point.set_row(axis, &(by_point.row(axis) * per_pixel[axis]));
    }
    Ok(model)
}

/// Newton steps allowed: three or four reach the last digit of a lens that is one to one.
const MAX_STEPS: usize = 30;

/// The observed image point of a corrected one (millimetre), and its derivative.
fn observed_point(camera: &Camera, corrected: Vector2<f64>) -> Option<([f64; 2], Matrix2<f64>)> {
    let mut image = corrected;
    for _ in 0..MAX_STEPS {
        let derivative = Matrix2::identity() - camera.lens.correction_slope(&camera.interior, image.into());
        if derivative.determinant() <= 0.0 || derivative.trace() <= 0.0 {
            return None;
        }
        let inverse = derivative.try_inverse()?;
        let correction = Vector2::from(camera.lens.correction(&camera.interior, image.into()));
        let step = inverse * (corrected + correction - image);
        image += step;
        if step.norm() <= 1e-14 * (1.0 + image.norm()) {
            return Some((image.into(), inverse));
        }
    }
    None
}
