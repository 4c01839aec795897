use std::sync::Arc;

use camera_model::{Camera, RayTable};

use crate::stages::line::Making;
use crate::stages::{Findings, Found, ViewStage};
use crate::survey::view::{View, ViewData};
use crate::{Error, Result};

/// From here on the calibrated camera gives the rays.
pub(super) struct CorrectImagePoint {
    largest_shift_px: f64,
}

impl CorrectImagePoint {
    pub(super) fn new(making: &mut Making<'_>) -> Result<Self> {
        let Some(camera) = making.survey.calibrated_camera else {
            return Err(Error::Camera(
                "stage CorrectImagePoint needs a calibration; name one with --calibration".to_owned(),
            ));
        };
        let fail = Error::stage("CorrectImagePoint", "calibration");
        let largest_shift_px = largest_shift_px(&making.camera, &camera)?;
        making.rays = Arc::new(RayTable::new(&camera).map_err(fail)?);
        making.camera = camera;
        Ok(Self { largest_shift_px })
    }
}

impl ViewStage for CorrectImagePoint {
    fn apply(&self, _: &mut View, _: &mut Found) -> Result<()> {
        Ok(())
    }

    fn findings(&self, _: &Found) -> Findings {
        Findings::from([("largest_shift_px".to_owned(), self.largest_shift_px)])
    }
}

/// How far the calibrated camera moves an image point, at the corners, where it is most.
fn largest_shift_px(nominal: &Camera, camera: &Camera) -> Result<f64> {
    let format = camera.format;
    let (right, bottom) = (format.width as f64 - 1.0, format.height as f64 - 1.0);
    let mut largest = 0.0_f64;
    for pixel in [[0.0, 0.0], [right, 0.0], [0.0, bottom], [right, bottom]] {
        let seen = camera.point(pixel, 1.0);
        let nominal = nominal.project(&seen).map_err(Error::stage("CorrectImagePoint", "calibration"))?;
        largest = largest.max((nominal[0] - pixel[0]).hypot(nominal[1] - pixel[1]));
    }
    Ok(largest)
}

/// Ranges along their rays, less what the width of their pixels does to them: points in the camera's frame.
pub(super) struct PointCloud {
    pub(super) rays: Arc<RayTable>,
}

impl ViewStage for PointCloud {
    fn apply(&self, view: &mut View, found: &mut Found) -> Result<()> {
        let ViewData::Range(frame) = &view.data else {
            return Err(Error::Needs { stage: "PointCloud", needs: "Unwrap" });
        };
        let points = self.rays.back_project(frame).and_then(|mut cloud| {
            self.rays.take_off_pixel_width(&mut cloud)?;
            Ok(cloud)
        });
        let cloud = points.map_err(Error::stage("PointCloud", &view.name()))?;
        found.add("points", cloud.valid_count());
        view.cloud = Some(cloud);
        Ok(())
    }
}
