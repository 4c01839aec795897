//! Stations in the room, with every error drawn from what is stated of it.

use std::collections::BTreeMap;

use fusion::Registered;
use fusion::nalgebra::{DMatrix, Isometry3, Matrix3, Point3, Vector3};
use fusion::point_uncertainty::camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion, step_pose};
use fusion::point_uncertainty::error_models::RangeErrorModel;
use fusion::point_uncertainty::{
    Columns, CommonError, CommonErrors, PointErrors, SharedBySensor, Source, StationErrors,
};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::scene::Scene;

/// What is drawn, and what is stated.
#[derive(Debug, Clone)]
pub struct Plan {
    pub size: (usize, usize),
    /// Stations, of those in [`eyes`].
    pub stations: usize,
    /// Frames of each station.
    pub frames: usize,
    /// Standard deviation of noise at one metre, proportional to the range; on the dark floor it is three times as large.
    pub noise_m: f64,
    pub sensor_m: f64,
    pub d0_m: f64,
    pub lens_mm: f64,
    pub pose_m: f64,
    pub pose_rad: f64,
    /// What is added to the pose of a station beyond what is stated: station, metre along x.
    pub gross: Option<(usize, f64)>,
}

impl Default for Plan {
    fn default() -> Self {
        Self {
            size: (96, 72),
            stations: 6,
            frames: 1,
            noise_m: 0.004,
            sensor_m: 0.002,
            d0_m: 0.003,
            lens_mm: 0.01,
            pose_m: 0.004,
            pose_rad: 0.002,
            gross: None,
        }
    }
}

pub struct Survey {
    pub scene: Scene,
    pub points: Vec<Point3<f64>>,
    pub frames: Vec<u32>,
    pub centres: Vec<Point3<f64>>,
    pub sigma: Vec<f64>,
    pub stations: Vec<StationErrors>,
    pub common: CommonErrors,
    /// The common errors as they are.
    pub drawn: Vec<f64>,
}

fn eyes() -> [([f64; 3], [f64; 3]); 6] {
    [
        ([0.4, 2.5, 1.6], [2.0, 0.8, 0.6]),
        ([3.6, 2.6, 1.5], [1.2, 1.2, 0.7]),
        ([3.5, 0.4, 1.3], [1.6, 2.2, 0.9]),
        ([0.5, 0.4, 1.7], [2.6, 1.8, 0.7]),
        ([2.4, 2.6, 1.9], [1.5, 1.0, 0.2]),
        ([0.7, 1.6, 1.0], [1.6, 2.6, 1.0]),
    ]
}

pub fn is_dark(point: &Point3<f64>) -> bool {
    point.x > 2.6 && point.y > 1.7 && point.z < 0.4
}

fn error(name: String, source: Source) -> CommonError {
    CommonError { name, source }
}

fn covariance(plan: &Plan) -> CommonErrors {
    let mut errors: Vec<CommonError> =
        ["xp", "yp", "c", "d0"].map(|name| error(name.to_owned(), Source::Calibration)).to_vec();
    let mut deviations = vec![plan.lens_mm, plan.lens_mm, plan.lens_mm, plan.d0_m];
    for station in 0..plan.stations {
        for (at, name) in ["dx", "dy", "dz", "rx", "ry", "rz"].iter().enumerate() {
            errors.push(error(format!("S{station:02} {name}"), Source::Pose));
            deviations.push(if at < 3 { plan.pose_m } else { plan.pose_rad });
        }
    }
    let size = errors.len();
    let covariance =
        DMatrix::from_fn(size, size, |row, column| if row == column { deviations[row].powi(2) } else { 0.0 });
    CommonErrors::new(errors, covariance).unwrap()
}

fn camera(plan: &Plan, by: [f64; 3]) -> Camera {
    let (width, height) = plan.size;
    let pitch = 7.7 / width as f64;
    let format = ImageFormat::new(width, height, [pitch, pitch]).unwrap();
    let interior = InteriorOrientation { principal_point_mm: [by[0], by[1]], principal_distance_mm: 5.5 + by[2] };
    Camera::new(format, interior, LensDistortion::default()).unwrap()
}

impl Survey {
    pub fn new(plan: &Plan, seed: u64) -> Self {
        let mut random = Pcg64::new(u128::from(seed), 7);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let common = covariance(plan);
        let drawn: Vec<f64> =
            (0..common.errors().len()).map(|at| normal() * common.covariance()[(at, at)].sqrt()).collect();
        let (true_camera, stated_camera) = (camera(plan, [0.0; 3]), camera(plan, [drawn[0], drawn[1], drawn[2]]));
        let model = RangeErrorModel::error_free(7.5);
        let mut survey = Self {
            scene: Scene::room(),
            points: Vec::new(),
            frames: Vec::new(),
            centres: Vec::new(),
            sigma: Vec::new(),
            stations: Vec::new(),
            common,
            drawn: drawn.clone(),
        };
        for station in 0..plan.stations {
            let (eye, target) = eyes()[station];
            let truth = Isometry3::look_at_rh(&eye.into(), &target.into(), &Vector3::z()).inverse();
            let mut step: [f64; 6] = std::array::from_fn(|at| drawn[4 + 6 * station + at]);
            step[0] += plan.gross.filter(|(which, _)| *which == station).map_or(0.0, |(_, by)| by);
            let stated = step_pose(&truth, &step);
            for _ in 0..plan.frames {
                let columns = Columns {
                    camera: vec![(0, 0), (1, 1), (2, 2)],
                    range: vec![(0, 3)],
                    drift: None,
                    pose: Some(4 + 6 * station),
                    hyperbola: Vec::new(),
                };
                let number = survey.stations.len() as u32;
                let count = survey.common.errors().len();
                let errors = StationErrors::new(number, &stated_camera, Some(&model), &stated, columns, count)
                    .unwrap()
                    .with_sensor(SharedBySensor { sigma_m: plan.sensor_m, share: 0.0, width_px: 8.0 })
                    .unwrap();
                survey.centres.push(stated.translation.vector.into());
                survey.stations.push(errors);
                survey.frame(plan, (&true_camera, &truth), (&stated_camera, &stated), drawn[3], &mut normal);
            }
        }
        survey
    }

    fn frame(
        &mut self,
        plan: &Plan,
        truth: (&Camera, &Isometry3<f64>),
        stated: (&Camera, &Isometry3<f64>),
        d0_m: f64,
        normal: &mut impl FnMut() -> f64,
    ) {
        let errors = self.stations.last().unwrap();
        let eye: Point3<f64> = truth.1.translation.vector.into();
        let mut shared: BTreeMap<u64, f64> = BTreeMap::new();
        for row in 0..plan.size.1 {
            for col in 0..plan.size.0 {
                // Not at the border of a neighbourhood, where rounding decides.
                let pixel = [col as f64 + 0.25, row as f64 + 0.25];
                let ray = truth.1 * truth.0.point(pixel, 1.0) - eye;
                let Some((range_m, _)) = self.scene.cast(&eye, &ray) else { continue };
                let dark = if is_dark(&(eye + ray * range_m)) { 3.0 } else { 1.0 };
                let sigma = plan.noise_m * range_m * dark;
                let place = stated.1 * stated.0.point(pixel, range_m);
                let sensor = errors
                    .sensor(&place, sigma)
                    .map_or(0.0, |(id, shift)| *shared.entry(id).or_insert_with(&mut *normal) * shift.norm());
                let observed = range_m + sigma * normal() + sensor - d0_m;
                self.points.push(stated.1 * stated.0.point(pixel, observed));
                self.frames.push(self.centres.len() as u32 - 1);
                self.sigma.push(sigma);
            }
        }
    }

    pub fn registered(&self) -> Registered<'_> {
        Registered { points: &self.points, frames: &self.frames, centres: &self.centres, amplitudes: None }
    }
}

impl PointErrors for Survey {
    fn noise(&self, point: usize) -> Matrix3<f64> {
        self.stations[self.frames[point] as usize].noise(&self.points[point], self.sigma[point])
    }

    fn sensor(&self, point: usize) -> Option<(u64, Vector3<f64>)> {
        self.stations[self.frames[point] as usize].sensor(&self.points[point], self.sigma[point])
    }

    fn common(&self, point: usize, derivatives: &mut Vec<(usize, Vector3<f64>)>) {
        self.stations[self.frames[point] as usize].common(&self.points[point], f64::NAN, derivatives);
    }
}
