//! Cameras, and random views of a board.

use rand::{RngExt, SeedableRng};
use targets::camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion};
use targets::nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};

/// A range camera of 176 x 144 pixels with a wide lens and its distortion.
pub fn small_camera() -> Camera {
    camera(176, 144, 0.04, 8.0, -2.1e-3)
}

/// A camera of 640 x 480 pixels with a wide lens and its distortion.
pub fn large_camera() -> Camera {
    camera(640, 480, 0.01, 5.4, -3.0e-3)
}

pub fn camera(width: usize, height: usize, pitch_mm: f64, principal_distance_mm: f64, k1: f64) -> Camera {
    Camera::new(
        ImageFormat::new(width, height, [pitch_mm, pitch_mm]).unwrap(),
        InteriorOrientation { principal_point_mm: [3.0 * pitch_mm, -2.0 * pitch_mm], principal_distance_mm },
        LensDistortion { k1, p1: 1e-4, ..LensDistortion::default() },
    )
    .unwrap()
}

/// Where a board of `columns` x `rows` inner corners may be.
#[derive(Debug, Clone, Copy)]
pub struct Wanted {
    pub columns: usize,
    pub rows: usize,
    pub square_m: f64,
    /// Length of a field's side in the middle of the board, seen at a right angle, pixel.
    pub field_px: [f64; 2],
    /// Tilt against the image plane, degree.
    pub tilt_deg: [f64; 2],
    /// How far the outer fields' outer corners must lie inside the image, pixel; negative: may lie outside.
    pub inside_px: f64,
}

/// `camera_from_board`, and whether one was found that is wanted: after 400 draws the last is taken.
pub fn random_view(camera: &Camera, wanted: &Wanted, seed: u64) -> (Isometry3<f64>, bool) {
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
    let mut draw = |[low, high]: [f64; 2]| low + (high - low) * random.random::<f64>();
    let mut pose = Isometry3::identity();
    for _ in 0..400 {
        let focal_px = camera.interior.principal_distance_mm / camera.format.pixel_pitch_mm[0];
        let distance = focal_px * wanted.square_m / draw(wanted.field_px);
        let (width, height) = (camera.format.width as f64, camera.format.height as f64);
        let pixel = [draw([0.25, 0.75]) * width, draw([0.25, 0.75]) * height];
        let place = camera.ray(pixel);
        let axis = draw([0.0, std::f64::consts::TAU]);
        let tilt = draw(wanted.tilt_deg).to_radians();
        let tilt =
            UnitQuaternion::from_axis_angle(&Unit::new_normalize(Vector3::new(axis.cos(), axis.sin(), 0.0)), tilt);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), draw([0.0, std::f64::consts::TAU]));
        let rotation = tilt * turn;
        let middle = Vector3::new(wanted.columns as f64 - 1.0, 1.0 - wanted.rows as f64, 0.0) * (0.5 * wanted.square_m);
        let translation = place * (distance / -place.z) - rotation * middle;
        pose = Isometry3::from_parts(Translation3::from(translation), rotation);
        if outline(wanted).iter().all(|point| is_inside(camera, &(pose * point), wanted.inside_px)) {
            return (pose, true);
        }
    }
    (pose, false)
}

/// The corners of the board's outer fields, board frame.
fn outline(wanted: &Wanted) -> [Point3<f64>; 4] {
    let (right, down) = (wanted.columns as f64 * wanted.square_m, -(wanted.rows as f64) * wanted.square_m);
    let s = wanted.square_m;
    [[-s, s], [right, s], [right, down], [-s, down]].map(|[x, y]| Point3::new(x, y, 0.0))
}

fn is_inside(camera: &Camera, point: &Point3<f64>, inside_px: f64) -> bool {
    let Ok([col, row]) = camera.project(point) else { return false };
    let inside = |at: f64, size: usize| at >= inside_px && at <= size as f64 - 1.0 - inside_px;
    inside(col, camera.format.width) && inside(row, camera.format.height)
}

/// Pixel positions of the nodes, by row and column; `None` behind the camera.
pub fn true_nodes(camera: &Camera, camera_from_board: &Isometry3<f64>, wanted: &Wanted) -> Vec<([usize; 2], [f64; 2])> {
    let nodes = (0..wanted.rows).flat_map(|j| (0..wanted.columns).map(move |i| [i, j]));
    let seen = nodes.filter_map(|[i, j]| {
        let point = Point3::new(i as f64 * wanted.square_m, -(j as f64) * wanted.square_m, 0.0);
        Some(([i, j], camera.project(&(camera_from_board * point)).ok()?))
    });
    seen.collect()
}
