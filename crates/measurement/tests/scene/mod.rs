//! Surveys of a room corner with known shapes: stations with noise, neighbourhoods, a calibration, drifts and poses that err.

#![allow(dead_code)]

use measurement::nalgebra::{DMatrix, DVector, Isometry3, Matrix3, Point3, UnitQuaternion, Vector3};
use measurement::point_uncertainty::camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion};
use measurement::point_uncertainty::error_models::RangeErrorModel;
use measurement::point_uncertainty::{Columns, CommonError, CommonErrors, PointErrors, Source, StationErrors};
use measurement::{Cloud, Region};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

pub const WALL_Z: f64 = 0.0;
pub const BOARD_CENTRE: [f64; 3] = [-0.8, 0.5, 0.25];
pub const BOARD_TILT_RAD: f64 = 0.01;
pub const SPHERES: [([f64; 3], f64); 2] = [([0.2, 0.6, 0.3], 0.15), ([0.9, 0.6, 0.35], 0.15)];
pub const CYLINDER: ([f64; 3], [f64; 3], f64) = ([0.5, -0.5, 0.3], [1.0, 0.1, 0.05], 0.12);

const STATIONS: [[f64; 3]; 3] = [[-0.9, 0.3, 2.4], [0.1, -0.6, 2.6], [1.0, 0.4, 2.3]];
const CALIBRATION: usize = 4;
const PER_STATION: usize = 7;
const CELL_PX: usize = 6;

/// What a survey is made of.
#[derive(Clone, Copy)]
pub struct Setting {
    pub noise_m_per_m: f64,
    pub sensor_m: f64,
    /// Factor of the deviations of common errors.
    pub common: f64,
    /// Noise in the ranges over the noise that is stated.
    pub understated: f64,
    /// Amplitude of waves in the wall.
    pub waves_m: f64,
    pub width: usize,
}

impl Default for Setting {
    fn default() -> Self {
        Self { noise_m_per_m: 0.002, sensor_m: 0.002, common: 1.0, understated: 1.0, waves_m: 0.0, width: 96 }
    }
}

pub struct Survey {
    pub points: Vec<Point3<f64>>,
    /// Where the points would be without any error.
    pub truth: Vec<Point3<f64>>,
    pub errors: Errors,
    pub common: CommonErrors,
}

pub struct Errors {
    pub stations: Vec<StationErrors>,
    pub of_points: Vec<OfPoint>,
    pub points: Vec<Point3<f64>>,
    sensor_m: f64,
}

#[derive(Clone, Copy)]
pub struct OfPoint {
    pub station: usize,
    pub pixel: [usize; 2],
    pub sigma_m: f64,
}

impl Survey {
    pub fn cloud(&self) -> Cloud<'_> {
        Cloud { points: &self.points, errors: &self.errors, common: &self.common }
    }
}

impl PointErrors for Errors {
    fn noise(&self, point: usize) -> Matrix3<f64> {
        let of = self.of_points[point];
        self.stations[of.station].noise(&self.points[point], of.sigma_m)
    }

    fn sensor(&self, point: usize) -> Option<(u64, Vector3<f64>)> {
        let of = self.of_points[point];
        let ray = self.stations[of.station].ray(&self.points[point]);
        (self.sensor_m > 0.0).then(|| (cell(of.station, of.pixel), ray * self.sensor_m))
    }

    fn common(&self, point: usize, derivatives: &mut Vec<(usize, Vector3<f64>)>) {
        self.stations[self.of_points[point].station].common(&self.points[point], f64::NAN, derivatives);
    }
}

fn cell(station: usize, pixel: [usize; 2]) -> u64 {
    let [column, row] = pixel.map(|at| (at / CELL_PX) as u64);
    (station as u64) << 32 | column << 16 | row
}

pub fn camera(width: usize, errors: &[f64]) -> Camera {
    let height = width * 4 / 5;
    let pitch = 9.6 / width as f64;
    let format = ImageFormat::new(width, height, [pitch, pitch]).unwrap();
    let interior =
        InteriorOrientation { principal_point_mm: [-errors[1], 0.0], principal_distance_mm: 8.0 - errors[2] };
    Camera::new(format, interior, LensDistortion { k1: -errors[3], ..LensDistortion::default() }).unwrap()
}

fn pose(at: [f64; 3]) -> Isometry3<f64> {
    let centre = Point3::from(at);
    let back = (centre - Point3::new(0.0, 0.1, 0.1)).normalize();
    let right = Vector3::y().cross(&back).normalize();
    let rotation = Matrix3::from_columns(&[right, back.cross(&right), back]);
    Isometry3::from_parts(centre.into(), UnitQuaternion::from_matrix(&rotation))
}

/// Root of the covariance of the common errors: d0, xp, c, k1, and of each station drift and pose. Poses err with d0.
fn root(factor: f64) -> DMatrix<f64> {
    let size = CALIBRATION + PER_STATION * STATIONS.len();
    let mut root = DMatrix::zeros(size, size);
    for (at, sigma) in [0.003, 0.01, 0.01, 1e-4].into_iter().enumerate() {
        root[(at, at)] = sigma;
    }
    for station in 0..STATIONS.len() {
        let first = CALIBRATION + PER_STATION * station;
        for (at, sigma) in [0.0015, 0.002, 0.002, 0.002, 0.001, 0.001, 0.001].into_iter().enumerate() {
            root[(first + at, first + at)] = sigma;
        }
        root[(first + 3, 0)] = 0.0015;
    }
    root * factor
}

pub fn common_errors(factor: f64) -> CommonErrors {
    let root = root(factor);
    let mut errors: Vec<CommonError> =
        ["d0", "xp", "c", "k1"].map(|name| CommonError { name: name.to_owned(), source: Source::Calibration }).to_vec();
    for station in 0..STATIONS.len() {
        errors.push(CommonError { name: format!("S{station} drift"), source: Source::Drift });
        let pose = |at| CommonError { name: format!("S{station} pose {at}"), source: Source::Pose };
        errors.extend((0..6).map(pose));
    }
    CommonErrors::new(errors, &root * root.transpose()).unwrap()
}

fn columns(station: usize) -> Columns {
    let first = CALIBRATION + PER_STATION * station;
    Columns {
        camera: vec![(0, 1), (2, 2), (3, 3)],
        range: vec![(0, 0)],
        hyperbola: Vec::new(),
        drift: Some(first),
        pose: Some(first + 1),
    }
}

/// A survey with errors drawn by this seed.
pub fn survey(setting: &Setting, seed: u64) -> Survey {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let common = common_errors(setting.common);
    let size = common.errors().len();
    let drawn = root(setting.common) * DVector::from_fn(size, |_, _| normal());
    let nominal = camera(setting.width, &[0.0; 4]);
    let real = camera(setting.width, drawn.as_slice());
    let mut survey = Survey {
        points: Vec::new(),
        truth: Vec::new(),
        errors: Errors { stations: Vec::new(), of_points: Vec::new(), points: Vec::new(), sensor_m: setting.sensor_m },
        common,
    };
    for (station, at) in STATIONS.into_iter().enumerate() {
        let world_from_camera = pose(at);
        let first = CALIBRATION + PER_STATION * station;
        let step = drawn.rows(first + 1, 6);
        let turn = UnitQuaternion::from_scaled_axis(-Vector3::new(step[3], step[4], step[5]));
        let moved = world_from_camera.translation.vector - Vector3::new(step[0], step[1], step[2]);
        let real_pose = Isometry3::from_parts(moved.into(), world_from_camera.rotation * turn);
        let (width, height) = (setting.width, setting.width * 4 / 5);
        let cells: Vec<f64> = (0..(width / CELL_PX + 1) * (height / CELL_PX + 1)).map(|_| normal()).collect();
        for at in 0..width * height {
            let pixel = [at % width, at / width];
            let position = pixel.map(|at| at as f64);
            let (start, ray) = (real_pose.translation.vector, real_pose.rotation * real.ray(position));
            let noise = normal();
            let Some(range) = first_hit(&start, &ray, setting.waves_m) else { continue };
            let sigma_m = setting.noise_m_per_m * range;
            let shared = cells[pixel[0] / CELL_PX + (width / CELL_PX + 1) * (pixel[1] / CELL_PX)];
            let off = noise * sigma_m * setting.understated + shared * setting.sensor_m - drawn[0] - drawn[first];
            survey.points.push(world_from_camera * nominal.point(position, range + off));
            survey.truth.push((start + ray * range).into());
            survey.errors.of_points.push(OfPoint { station, pixel, sigma_m });
        }
        let model = RangeErrorModel::error_free(7.5);
        let errors =
            StationErrors::new(station as u32, &nominal, Some(&model), &world_from_camera, columns(station), size);
        survey.errors.stations.push(errors.unwrap());
    }
    survey.errors.points.clone_from(&survey.points);
    survey
}

fn first_hit(start: &Vector3<f64>, ray: &Vector3<f64>, waves_m: f64) -> Option<f64> {
    let hits = [
        Some(wall(start, ray, waves_m)),
        board(start, ray),
        sphere(start, ray, 0),
        sphere(start, ray, 1),
        cylinder(start, ray),
    ];
    hits.into_iter().flatten().filter(|range| *range > 0.0).reduce(f64::min)
}

/// Height of the wall's waves.
pub fn wave(x: f64, y: f64, waves_m: f64) -> f64 {
    waves_m * (9.0 * x).sin() * (11.0 * y).sin()
}

fn wall(start: &Vector3<f64>, ray: &Vector3<f64>, waves_m: f64) -> f64 {
    let mut range = (WALL_Z - start.z) / ray.z;
    let rounds = if waves_m > 0.0 { 20 } else { 0 };
    for _ in 0..rounds {
        let at = start + ray * range;
        range = (WALL_Z + wave(at.x, at.y, waves_m) - start.z) / ray.z;
    }
    range
}

pub fn board_normal() -> Vector3<f64> {
    Vector3::new(BOARD_TILT_RAD.sin(), 0.0, BOARD_TILT_RAD.cos())
}

fn board(start: &Vector3<f64>, ray: &Vector3<f64>) -> Option<f64> {
    let centre = Vector3::from(BOARD_CENTRE);
    let range = board_normal().dot(&(centre - start)) / board_normal().dot(ray);
    let way = start + ray * range - centre;
    (way.x.abs() < 0.4 && way.y.abs() < 0.4).then_some(range)
}

fn sphere(start: &Vector3<f64>, ray: &Vector3<f64>, which: usize) -> Option<f64> {
    let (centre, radius) = SPHERES[which];
    near(start - Vector3::from(centre), *ray, radius)
}

fn near(offset: Vector3<f64>, slope: Vector3<f64>, radius: f64) -> Option<f64> {
    let (square, half) = (slope.norm_squared(), offset.dot(&slope));
    let root = (half * half - square * (offset.norm_squared() - radius * radius)).sqrt();
    (root >= 0.0).then(|| (-half - root) / square)
}

pub fn cylinder_axis() -> Vector3<f64> {
    Vector3::from(CYLINDER.1).normalize()
}

fn cylinder(start: &Vector3<f64>, ray: &Vector3<f64>) -> Option<f64> {
    let (centre, axis) = (Vector3::from(CYLINDER.0), cylinder_axis());
    let across = |vector: Vector3<f64>| vector - axis * axis.dot(&vector);
    let range = near(across(start - centre), across(*ray), CYLINDER.2)?;
    (axis.dot(&(start + ray * range - centre)).abs() < 0.5).then_some(range)
}

pub fn wall_region() -> Region {
    Region::Box { from_m: [-0.3, -0.2, -0.1], to_m: [0.9, 0.35, 0.1] }
}

pub fn board_region() -> Region {
    Region::Box { from_m: [-1.15, 0.15, 0.15], to_m: [-0.45, 0.85, 0.35] }
}

pub fn sphere_region(which: usize) -> Region {
    Region::Sphere { centre_m: SPHERES[which].0, radius_m: 0.2 }
}

pub fn cylinder_region() -> Region {
    let (centre, axis) = (Vector3::from(CYLINDER.0), cylinder_axis());
    Region::Cylinder { from_m: (centre - axis * 0.4).into(), to_m: (centre + axis * 0.4).into(), radius_m: 0.17 }
}
