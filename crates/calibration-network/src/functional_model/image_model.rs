//! The image point that a camera observes of a point in its frame: the fixed point of Eqs. 4, 5 and 8-13.

use adjust::EvaluationFailure;
use camera_model::Camera;
use nalgebra::{Isometry3, Matrix2x3, Point3, Vector3};

use crate::functional_model::terms::camera_from;

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
    let (own_frame, point) = (Isometry3::identity(), Point3::from(*point));
    let failed = |error: camera_model::Error| EvaluationFailure::new(error.to_string());
    let mut model = ImageModel { pixel: [0.0; 2], by_camera_point: Matrix2x3::zeros(), by_camera: Default::default() };
    if !derivatives {
        let seen = camera.observe(&own_frame, &point).map_err(failed)?;
        model.pixel = camera.format.pixel_from_image(seen.image_mm);
        return Ok(model);
    }
    let (seen, by) = camera.observe_with_jacobians(&own_frame, &point).map_err(failed)?;
    model.pixel = camera.format.pixel_from_image(seen.image_mm);
    let [pitch_x, pitch_y] = camera.format.pixel_pitch_mm;
    for (axis, per_pixel) in [1.0 / pitch_x, -1.0 / pitch_y].into_iter().enumerate() {
        model.by_camera_point.set_row(axis, &(by.point.row(axis) * per_pixel));
        let (interior, lens) = (by.interior.row(axis), by.lens.row(axis));
        model.by_camera[axis] = interior.iter().chain(lens.iter()).map(|derivative| derivative * per_pixel).collect();
    }
    Ok(model)
}
