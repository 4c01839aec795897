//! Stations around a furnished room, their ranges with errors of Eq. 14.
#![allow(dead_code, clippy::unwrap_used, clippy::expect_used, clippy::panic, missing_docs)]

#[path = "../../../point-cloud/tests/common/mod.rs"]
pub mod room;

use camera_model::{Camera, InteriorOrientation, LensDistortion};
use error_models::RangeErrorModel;
use nalgebra::{Isometry3, Vector3};
use range_image::{Flags, ImageFormat, RangeFrame, Raster};
use room::stations::round_poses;
use room::{Pinhole, Scene};

/// 30 MHz.
pub const INTERVAL_M: f64 = 5.0;
const PITCH_MM: f64 = 0.04;

/// The camera of the frames: 176 x 144 pixels without distortion.
pub fn camera() -> Camera {
    let pinhole = Pinhole::small();
    let format = ImageFormat::new(pinhole.width, pinhole.height, [PITCH_MM; 2]).unwrap();
    let interior =
        InteriorOrientation { principal_point_mm: [0.0; 2], principal_distance_mm: pinhole.focal_px * PITCH_MM };
    Camera::new(format, interior, LensDistortion::default()).unwrap()
}

/// A model with these terms by name.
pub fn model(terms: &[(&str, f64)]) -> RangeErrorModel {
    let mut model = RangeErrorModel::error_free(INTERVAL_M);
    let mut values = model.parameter_values();
    for (index, name) in model.parameter_names().iter().enumerate() {
        values[index] = terms.iter().find(|(term, _)| term == name).map_or(0.0, |(_, value)| *value);
    }
    model.set_parameter_values(&values).unwrap();
    model
}

/// Poses of stations on a round.
pub fn poses(count: usize) -> Vec<Isometry3<f64>> {
    round_poses(count)
}

/// Frames from these poses: noise of 1 mm + 0.5 mm/m² range², and the errors of the model.
pub fn frames(poses: &[Isometry3<f64>], model: &RangeErrorModel, seed: u64) -> Vec<RangeFrame> {
    let (scene, pinhole, camera) = (Scene::furnished(), Pinhole::small(), camera());
    let frame = |(index, pose): (u64, &Isometry3<f64>)| {
        let (points, sigma) = room::frame(&scene, &pinhole, pose, 1.0, 1000 * seed + index);
        let observed = points.iter().enumerate().map(|(pixel, point)| {
            let range = Vector3::from(*point).norm();
            let pixel = [(pixel % pinhole.width) as f64, (pixel / pinhole.width) as f64];
            let [x, y] = camera.format.image_from_pixel(pixel);
            // Corrections are functions of the observed range: its fixed point.
            let error = |observed: f64| model.correction(observed, x, y, 1.0).total_m();
            (0..30).fold(range, |observed, _| range + error(observed)) as f32
        });
        let (width, height) = (pinhole.width, pinhole.height);
        RangeFrame {
            range: Raster::from_vec(width, height, observed.collect()).unwrap(),
            sigma: Raster::from_vec(width, height, sigma).unwrap(),
            amplitude: Raster::filled(width, height, 1.0),
            flags: Raster::filled(width, height, Flags::empty()),
        }
    };
    (0_u64..).zip(poses).map(frame).collect()
}
