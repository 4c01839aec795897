//! Messages of ROS made from what a survey has.

use camera_model::Camera;
use commands::Result;
use recordings::{CameraInfo, Image, Payload};

use super::refused;

/// A camera in ROS's words: computer-vision axes, pixels.
pub(super) fn camera_info(
    frame_id: &str,
    [width, height]: [usize; 2],
    ([fx, fy], [cx, cy]): ([f64; 2], [f64; 2]),
    model: &str,
    distortion: Vec<f64>,
) -> CameraInfo {
    CameraInfo {
        frame_id: frame_id.to_owned(),
        width: width as u32,
        height: height as u32,
        distortion_model: model.to_owned(),
        distortion,
        matrix: [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        rectification: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        projection: [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
        ..CameraInfo::default()
    }
}

/// The `plumb_bob` that agrees best with a camera, and its largest residual in pixels.
pub(super) fn plumb_bob(frame_id: &str, camera: &Camera) -> Result<(CameraInfo, f64)> {
    let (model, residual_px) = camera.to_plumb_bob().map_err(|error| commands::Error::Camera(error.to_string()))?;
    let matrix = ([model.fx, model.fy], [model.cx, model.cy]);
    let lens = vec![model.k1, model.k2, model.p1, model.p2, model.k3];
    Ok((camera_info(frame_id, [model.width, model.height], matrix, "plumb_bob", lens), residual_px))
}

/// An image of single precision.
pub(super) fn image(frame_id: &str, plane: &range_image::Raster<f32>) -> Result<Payload> {
    let size = [plane.width() as u32, plane.height() as u32];
    let image = Image::from_f32(frame_id, size, plane.as_slice());
    image.map(Payload::Image).map_err(|error| refused(error.to_string()))
}
