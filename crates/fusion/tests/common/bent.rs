//! A depth camera that bends all its frames alike, before a wall and a floor.

use fusion::Registered;
use fusion::nalgebra::{DMatrix, Isometry3, Matrix3, Point3, Vector3};
use fusion::point_uncertainty::camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion, step_pose};
use fusion::point_uncertainty::{
    Columns, CommonError, CommonErrors, PointErrors, SharedBySensor, SharedErrorGrid, Source, StationErrors,
};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

/// Columns and rows of the image.
const SIZE: (usize, usize) = (120, 90);
/// Standard deviations of a pose.
const POSE_M: f64 = 0.004;
const POSE_RAD: f64 = 0.002;
/// Noise of a depth at one metre, with what neighbourhoods of four pixels share.
const NOISE_M: f64 = 0.0015;
const SHARE: f64 = 0.5;

/// Where the camera stands and looks to: on the wall y = 2 and the floor z = 0.
const EYES: [([f64; 3], [f64; 3]); 4] = [
    ([-0.3, 0.2, 1.0], [0.0, 2.0, 0.5]),
    ([0.0, 0.1, 1.1], [0.2, 2.0, 0.6]),
    ([0.4, 0.3, 0.9], [-0.1, 2.0, 0.4]),
    ([0.1, 0.4, 1.2], [-0.2, 2.0, 0.3]),
];

pub struct Bent {
    pub points: Vec<Point3<f64>>,
    frames: Vec<u32>,
    centres: Vec<Point3<f64>>,
    sigma: Vec<f64>,
    stations: Vec<StationErrors>,
    pub common: CommonErrors,
    pub grid: SharedErrorGrid,
    /// The shared error at the nodes, 1/metre.
    pub drawn: Vec<f64>,
}

impl Bent {
    /// A camera whose shared error has this standard deviation (1/metre) and is alike over twelve pixels.
    pub fn new(sigma_per_m: f64, seed: u128) -> Self {
        let mut random = Pcg64::new(seed, 11);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let format = ImageFormat::new(SIZE.0, SIZE.1, [0.05, 0.05]).unwrap();
        let interior = InteriorOrientation { principal_point_mm: [0.0; 2], principal_distance_mm: 5.5 };
        let camera = Camera::new(format, interior, LensDistortion::default()).unwrap();
        let grid = SharedErrorGrid::new(6 * EYES.len(), &format);
        let mut bent = Self {
            points: Vec::new(),
            frames: Vec::new(),
            centres: Vec::new(),
            sigma: Vec::new(),
            stations: Vec::new(),
            common: common(&grid),
            drawn: draw(&grid, sigma_per_m, &mut normal),
            grid,
        };
        for (number, (eye, target)) in EYES.iter().enumerate() {
            let truth = Isometry3::look_at_rh(&(*eye).into(), &(*target).into(), &Vector3::z()).inverse();
            let step: [f64; 6] = std::array::from_fn(|at| normal() * if at < 3 { POSE_M } else { POSE_RAD });
            let stated = step_pose(&truth, &step);
            let columns = Columns { pose: Some(6 * number), ..Columns::default() };
            let count = bent.common.errors().len();
            let sensor = SharedBySensor { sigma_m: 0.0, share: SHARE, width_px: 4.0 };
            let errors = StationErrors::new(number as u32, &camera, None, &stated, columns, count);
            bent.stations.push(errors.unwrap().with_sensor(sensor).unwrap().with_shared_error(grid, count).unwrap());
            bent.centres.push(stated.translation.vector.into());
            bent.frame(&camera, &truth, &stated, &mut normal);
        }
        bent
    }

    fn frame(
        &mut self,
        camera: &Camera,
        truth: &Isometry3<f64>,
        stated: &Isometry3<f64>,
        normal: &mut impl FnMut() -> f64,
    ) {
        let eye = truth.translation.vector;
        let width = SIZE.0.div_ceil(4);
        let neighbours: Vec<f64> = (0..width * SIZE.1.div_ceil(4)).map(|_| normal()).collect();
        for (row, col) in (0..SIZE.1).flat_map(|row| (0..SIZE.0).map(move |col| (row, col))) {
            // Not at the border of a neighbourhood, where rounding decides.
            let pixel = [col as f64 + 0.1, row as f64 + 0.1];
            let ray = truth.rotation * camera.point(pixel, 1.0).coords;
            let [to_wall, to_floor] = [(2.0 - eye.y) / ray.y, -eye.z / ray.z].map(|r| if r > 0.0 { r } else { 9.0 });
            let range_m = to_wall.min(to_floor);
            if range_m > 5.0 {
                continue;
            }
            let depth_m = -camera.point(pixel, range_m).z;
            let sigma_m = NOISE_M * depth_m * range_m;
            let shared = self.bent_by(pixel) * depth_m * range_m;
            let own = (1.0 - SHARE).sqrt() * normal() + SHARE.sqrt() * neighbours[row / 4 * width + col / 4];
            self.points.push(stated * camera.point(pixel, range_m - shared + sigma_m * own));
            self.frames.push(self.centres.len() as u32 - 1);
            self.sigma.push(sigma_m);
        }
    }

    /// The shared error of a pixel, bilinear between the nodes.
    fn bent_by(&self, pixel: [f64; 2]) -> f64 {
        let [col, row] = pixel.map(|at| (at + 0.5) / self.grid.spacing_px());
        let (right, below) = (col.fract(), row.fract());
        let node =
            |aside: usize, down: usize| self.drawn[(row as usize + down) * self.grid.nodes()[0] + col as usize + aside];
        (1.0 - below) * ((1.0 - right) * node(0, 0) + right * node(1, 0))
            + below * ((1.0 - right) * node(0, 1) + right * node(1, 1))
    }

    pub fn registered(&self) -> Registered<'_> {
        Registered { points: &self.points, frames: &self.frames, centres: &self.centres, amplitudes: None }
    }
}

/// Poses as they were drawn; of the shared error nothing is stated.
fn common(grid: &SharedErrorGrid) -> CommonErrors {
    let poses = 6 * EYES.len();
    let error = |at: usize| CommonError {
        name: format!("error {at}"),
        source: if at < poses { Source::Pose } else { Source::Calibration },
    };
    let size = grid.columns().end;
    let variance = |at: usize| match at {
        at if at >= poses => 0.0,
        at if at % 6 < 3 => POSE_M * POSE_M,
        _ => POSE_RAD * POSE_RAD,
    };
    let covariance = DMatrix::from_fn(size, size, |row, column| if row == column { variance(row) } else { 0.0 });
    CommonErrors::new((0..size).map(error).collect(), covariance).unwrap()
}

/// Values at the nodes that are alike over two of them, without their linear part.
fn draw(grid: &SharedErrorGrid, sigma_per_m: f64, normal: &mut impl FnMut() -> f64) -> Vec<f64> {
    let [across, down] = grid.nodes();
    let place = |node: usize| [(node % across) as f64, (node / across) as f64];
    let size = across * down;
    let correlation = DMatrix::from_fn(size, size, |row, column| {
        let ([x, y], [u, v]) = (place(row), place(column));
        (-(x - u).hypot(y - v) / 2.0).exp()
    });
    let white = DMatrix::from_fn(size, 1, |_, _| normal() * sigma_per_m);
    let drawn = correlation.cholesky().unwrap().l() * white;
    let linear = DMatrix::from_fn(size, 3, |node, at| if at == 0 { 1.0 } else { place(node)[at - 1] });
    let basis = linear.qr().q();
    (&drawn - &basis * (basis.transpose() * &drawn)).iter().copied().collect()
}

impl PointErrors for Bent {
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
