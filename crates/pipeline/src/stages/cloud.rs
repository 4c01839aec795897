use camera_model::RayTable;

use crate::command::progress::Progress;
use crate::stages::Findings;
use crate::survey::view::ViewData;
use crate::survey::work::Work;
use crate::{Error, Result};

/// From here on the calibrated camera gives the rays.
pub(super) fn correct_image_point(work: &mut Work) -> Result<Findings> {
    let Some(camera) = work.calibrated_camera else {
        return Err(Error::Camera(
            "stage CorrectImagePoint needs a calibration; name one with --calibration".to_owned(),
        ));
    };
    let shift = largest_shift_px(work, &camera)?;
    work.rays = RayTable::new(&camera).map_err(Error::stage("CorrectImagePoint", "calibration"))?;
    work.outcome.camera = camera;
    Ok(Findings::from([("largest_shift_px".to_owned(), shift)]))
}

/// How far the calibrated camera moves an image point, at the corners, where it is most.
fn largest_shift_px(work: &Work, camera: &camera_model::Camera) -> Result<f64> {
    let format = camera.format;
    let (right, bottom) = (format.width as f64 - 1.0, format.height as f64 - 1.0);
    let mut largest = 0.0_f64;
    for pixel in [[0.0, 0.0], [right, 0.0], [0.0, bottom], [right, bottom]] {
        let seen = camera.point(pixel, 1.0);
        let nominal = work.outcome.camera.project(&seen).map_err(Error::stage("CorrectImagePoint", "calibration"))?;
        largest = largest.max((nominal[0] - pixel[0]).hypot(nominal[1] - pixel[1]));
    }
    Ok(largest)
}

/// Ranges along their rays: points in the camera's frame.
pub(super) fn run(work: &mut Work, progress: &dyn Progress) -> Result<Findings> {
    let mut points = 0_usize;
    work.outcome.clouds.clear();
    for (index, view) in work.outcome.views.iter().enumerate() {
        let ViewData::Range(frame) = &view.data else {
            return Err(Error::Needs { stage: "PointCloud", needs: "Unwrap" });
        };
        let cloud = work.rays.back_project(frame).map_err(Error::stage("PointCloud", &view.name()))?;
        points += cloud.points.iter().filter(|point| point[0].is_finite()).count();
        work.outcome.clouds.push(cloud);
        progress.advance(index + 1);
    }
    Ok(Findings::from([("points".to_owned(), points as f64)]))
}
