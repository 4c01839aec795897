//! Frames that look at the plane z = 0 from above, each from its own place.

use fusion::Registered;
use fusion::nalgebra::{DMatrix, Matrix3, Point3, Vector3};
use fusion::point_uncertainty::{CommonError, CommonErrors, PointErrors, Source};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

pub struct Wall {
    pub points: Vec<Point3<f64>>,
    pub frames: Vec<u32>,
    pub centres: Vec<Point3<f64>>,
    pub sigma_m: f64,
    pub sensor_m: f64,
    pub common: CommonErrors,
}

impl Wall {
    /// Frames of `side` by `side` points on a square of a metre. Noise is along the rays; each frame is shifted along z by an
    /// error of standard deviation `shift_m`, and neighbourhoods of 0.1 m share an error.
    pub fn new(frames: usize, side: usize, sigma_m: f64, sensor_m: f64, shift_m: f64, seed: u128) -> Self {
        let mut random = Pcg64::new(seed, 3);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let name = |at| CommonError { name: format!("S{at} dz"), source: Source::Pose };
        let covariance = DMatrix::identity(frames, frames) * (shift_m * shift_m);
        let common = CommonErrors::new((0..frames).map(name).collect(), covariance).unwrap();
        let mut wall = Self { points: Vec::new(), frames: Vec::new(), centres: Vec::new(), sigma_m, sensor_m, common };
        for frame in 0..frames {
            let angle = 2.4 * frame as f64;
            let centre = Point3::new(0.5 + 0.8 * angle.cos(), 0.5 + 0.8 * angle.sin(), 2.0);
            let shift = shift_m * normal();
            let shared: Vec<f64> = (0..400).map(|_| sensor_m * normal()).collect();
            wall.centres.push(centre);
            for at in 0..side * side {
                let place = [at % side, at / side].map(|v| (v as f64 + 0.37) / side as f64);
                let foot = Point3::new(place[0], place[1], 0.0);
                let ray = (foot - centre).normalize();
                let error = sigma_m * normal() + shared[cell(&foot)];
                wall.points.push(foot + ray * error + Vector3::z() * shift);
                wall.frames.push(frame as u32);
            }
        }
        wall
    }

    pub fn registered(&self) -> Registered<'_> {
        Registered { points: &self.points, frames: &self.frames, centres: &self.centres, amplitudes: None }
    }

    fn ray(&self, point: usize) -> Vector3<f64> {
        (self.points[point] - self.centres[self.frames[point] as usize]).normalize()
    }
}

/// Number of the neighbourhood of a point of the plane.
fn cell(foot: &Point3<f64>) -> usize {
    let at = |v: f64| ((v + 0.5) * 10.0).floor().clamp(0.0, 19.0) as usize;
    at(foot.x) * 20 + at(foot.y)
}

impl PointErrors for Wall {
    fn noise(&self, point: usize) -> Matrix3<f64> {
        let shift = self.ray(point) * self.sigma_m;
        shift * shift.transpose()
    }

    fn sensor(&self, point: usize) -> Option<(u64, Vector3<f64>)> {
        let (at, ray) = (self.points[point], self.ray(point));
        let foot = at - ray * (at.z / ray.z);
        (self.sensor_m > 0.0).then(|| (u64::from(self.frames[point]) << 32 | cell(&foot) as u64, ray * self.sensor_m))
    }

    fn common(&self, point: usize, derivatives: &mut Vec<(usize, Vector3<f64>)>) {
        derivatives.push((self.frames[point] as usize, Vector3::z()));
    }
}
