//! How well the mean distance of a wall is known by the number of its pixels: noise goes down with them, d0 and the error that
//! neighbouring pixels share do not, or later.
//!
//! `cargo run --release -p point-uncertainty --example mean_of_a_wall`
#![allow(clippy::print_stdout, clippy::unwrap_used, missing_docs)]

use point_uncertainty::camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion};
use point_uncertainty::error_models::RangeErrorModel;
use point_uncertainty::nalgebra::{DMatrix, Isometry3, Matrix3, Point3, Vector3};
use point_uncertainty::{
    Columns, CommonError, CommonErrors, Gradient, PointErrors, SharedBySensor, Source, StationErrors, shares,
};

struct Wall {
    points: Vec<Point3<f64>>,
    station: StationErrors,
}

impl PointErrors for Wall {
    fn noise(&self, point: usize) -> Matrix3<f64> {
        self.station.noise(&self.points[point], 0.010)
    }

    fn sensor(&self, point: usize) -> Option<(u64, Vector3<f64>)> {
        self.station.sensor(&self.points[point], 0.010)
    }

    fn common(&self, point: usize, derivatives: &mut Vec<(usize, Vector3<f64>)>) {
        self.station.common(&self.points[point], f64::NAN, derivatives);
    }
}

fn main() {
    let format = ImageFormat::new(176, 144, [0.04, 0.04]).unwrap();
    let interior = InteriorOrientation { principal_point_mm: [0.0, 0.0], principal_distance_mm: 8.0 };
    let camera = Camera::new(format, interior, LensDistortion::default()).unwrap();
    let model = RangeErrorModel::error_free(7.5);
    let d0 = CommonError { name: "d0".to_owned(), source: Source::Calibration };
    let common = CommonErrors::new(vec![d0], DMatrix::from_element(1, 1, 4e-6)).unwrap();
    let columns = Columns { range: vec![(0, 0)], ..Columns::default() };
    let station = StationErrors::new(0, &camera, Some(&model), &Isometry3::identity(), columns, 1).unwrap();
    let station = station.with_sensor(SharedBySensor { sigma_m: 0.003, share: 0.0, width_px: 8.0 }).unwrap();
    println!("{:>8} {:>10} {:>10} {:>12} {:>9}", "pixels", "noise, mm", "sensor, mm", "calibr., mm", "all, mm");
    for side in [1_usize, 4, 16, 64, 144] {
        let pixels = (0..side * side).map(|at| [(at % side) as f64, (at / side) as f64]);
        let points: Vec<Point3<f64>> = pixels.map(|[x, y]| camera.point([x + 16.0, y], 3.0)).collect();
        let share = 1.0 / points.len() as f64;
        let gradient: Gradient = (0..points.len()).map(|k| (k, points[k].coords.normalize() * share)).collect();
        let found = shares(&gradient, &Wall { points, station: station.clone() }, &common);
        let mm = |source| 1e3 * found.of(source).sqrt();
        println!(
            "{:>8} {:>10.3} {:>10.3} {:>12.3} {:>9.3}",
            side * side,
            mm(Source::Noise),
            mm(Source::Sensor),
            mm(Source::Calibration),
            1e3 * found.sigma()
        );
    }
}
