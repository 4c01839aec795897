//! A ray-cast room for the tests: the inside of a box with boxes on its floor.
#![allow(dead_code, clippy::unwrap_used, clippy::expect_used, clippy::panic, missing_docs)]

pub mod invalid;
pub mod limit;
pub mod scenes;
pub mod sensor;
pub mod stations;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use point_cloud::{Cloud, OrganisedNormalOptions, organised_normals};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

/// An axis-parallel box seen from outside, or (the room) from inside.
pub struct Cuboid {
    pub low: Vector3<f64>,
    pub high: Vector3<f64>,
}

impl Cuboid {
    pub fn new(low: [f64; 3], high: [f64; 3]) -> Self {
        Self { low: Vector3::from(low), high: Vector3::from(high) }
    }

    /// Distances at which the ray enters and leaves.
    fn hit(&self, origin: &Vector3<f64>, direction: &Vector3<f64>) -> (f64, f64) {
        let (mut near, mut far) = (f64::NEG_INFINITY, f64::INFINITY);
        for k in 0..3 {
            let (a, b) = ((self.low[k] - origin[k]) / direction[k], (self.high[k] - origin[k]) / direction[k]);
            near = near.max(a.min(b));
            far = far.min(a.max(b));
        }
        (near, far)
    }
}

pub struct Scene {
    pub room: Cuboid,
    pub boxes: Vec<Cuboid>,
}

impl Scene {
    /// 5 m x 4 m x 2.6 m with furniture.
    pub fn furnished() -> Self {
        Self {
            room: Cuboid::new([-2.5, -2.0, 0.0], [2.5, 2.0, 2.6]),
            boxes: vec![
                Cuboid::new([1.2, -1.9, 0.0], [2.2, -0.9, 0.9]),
                Cuboid::new([1.7, 0.6, 0.0], [2.4, 1.6, 1.8]),
                Cuboid::new([-0.4, 1.3, 0.0], [0.6, 1.9, 0.7]),
                Cuboid::new([-2.4, -1.2, 0.0], [-1.9, 0.3, 1.1]),
                Cuboid::new([-1.0, -2.0, 1.2], [0.0, -1.6, 1.9]),
                Cuboid::new([-2.3, 1.2, 0.0], [-1.5, 1.9, 2.0]),
            ],
        }
    }

    pub fn range(&self, origin: &Vector3<f64>, direction: &Vector3<f64>) -> f64 {
        let mut range = self.room.hit(origin, direction).1;
        for b in &self.boxes {
            let (near, far) = b.hit(origin, direction);
            if near > 0.0 && near < far {
                range = range.min(near);
            }
        }
        range
    }
}

/// A pinhole camera that looks along -z.
pub struct Pinhole {
    pub width: usize,
    pub height: usize,
    pub focal_px: f64,
}

impl Pinhole {
    /// 176 x 144 with about 60 x 50 degrees.
    pub fn small() -> Self {
        Self { width: 176, height: 144, focal_px: 152.0 }
    }

    /// 224 x 172 with 62 x 45 degrees.
    pub fn medium() -> Self {
        Self { width: 224, height: 172, focal_px: 186.0 }
    }

    /// 640 x 480 with about 62 x 49 degrees.
    pub fn large() -> Self {
        Self { width: 640, height: 480, focal_px: 530.0 }
    }

    /// Unit vector through the centre of a pixel.
    pub fn ray(&self, col: usize, row: usize) -> Vector3<f64> {
        self.ray_at(col as f64, row as f64)
    }

    /// Unit vector through a point of the image, pixels.
    pub fn ray_at(&self, col: f64, row: f64) -> Vector3<f64> {
        let x = col - (self.width as f64 - 1.0) / 2.0;
        let y = (self.height as f64 - 1.0) / 2.0 - row;
        Vector3::new(x, y, -self.focal_px).normalize()
    }
}

/// Camera at `position` that looks towards `at` (z is up in the room).
pub fn look_at(position: [f64; 3], at: [f64; 3]) -> Isometry3<f64> {
    let position = Vector3::from(position);
    let back = (position - Vector3::from(at)).normalize();
    let right = Vector3::z().cross(&back).normalize();
    let up = back.cross(&right);
    let matrix = nalgebra::Matrix3::from_columns(&[right, up, back]);
    let rotation = nalgebra::Rotation3::from_matrix_unchecked(matrix);
    Isometry3::from_parts(Translation3::from(position), UnitQuaternion::from_rotation_matrix(&rotation))
}

/// Standard deviation of a range: 1 mm + 0.5 mm/m² range².
pub fn sigma_of(range: f64) -> f64 {
    1e-3 + 0.5e-3 * range * range
}

/// Points of a frame in the camera frame with noise along the ray, and their sigma.
pub fn frame(
    scene: &Scene,
    camera: &Pinhole,
    world_from_camera: &Isometry3<f64>,
    noise: f64,
    seed: u64,
) -> (Vec<[f64; 3]>, Vec<f32>) {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut points = Vec::new();
    let mut sigmas = Vec::new();
    for row in 0..camera.height {
        for col in 0..camera.width {
            let ray = camera.ray(col, row);
            let direction = world_from_camera.rotation * ray;
            let range = scene.range(&world_from_camera.translation.vector, &direction);
            let sigma = sigma_of(range) * noise;
            let normal: f64 = StandardNormal.sample(&mut random);
            let point = ray * (range + sigma * normal);
            points.push([point.x, point.y, point.z]);
            sigmas.push(sigma_of(range) as f32);
        }
    }
    (points, sigmas)
}

/// A cloud with normals and sigma from a simulated frame.
pub fn cloud(scene: &Scene, camera: &Pinhole, world_from_camera: &Isometry3<f64>, noise: f64, seed: u64) -> Cloud {
    let (points, sigmas) = frame(scene, camera, world_from_camera, noise, seed);
    let normals = organised_normals(&points, camera.width, camera.height, &OrganisedNormalOptions::default()).unwrap();
    Cloud::from_frame(&points, Some(&normals), Some(&sigmas)).unwrap()
}

/// Size of the pixels' footprint that is sampled for mixed pixels: rays a side.
const RAYS: usize = 3;

/// As [`frame`], but each pixel sees the average over its footprint: at jumps of the range lie mixed pixels.
pub fn frame_with_mixed_pixels(
    scene: &Scene,
    camera: &Pinhole,
    world_from_camera: &Isometry3<f64>,
    seed: u64,
) -> (Vec<[f64; 3]>, Vec<f32>) {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut points = Vec::new();
    let mut sigmas = Vec::new();
    let origin = world_from_camera.translation.vector;
    for row in 0..camera.height {
        for col in 0..camera.width {
            let mean = (0..RAYS * RAYS)
                .map(|k| {
                    let offset = |i: usize| (i as f64 + 0.5) / RAYS as f64 - 0.5;
                    let ray = camera.ray_at(col as f64 + offset(k % RAYS), row as f64 + offset(k / RAYS));
                    scene.range(&origin, &(world_from_camera.rotation * ray))
                })
                .sum::<f64>()
                / (RAYS * RAYS) as f64;
            let ray = camera.ray(col, row);
            // On one surface the range along the central ray is exact; the average would curve walls.
            let central = scene.range(&origin, &(world_from_camera.rotation * ray));
            let range = if (mean - central).abs() > 0.01 { mean } else { central };
            let sigma = sigma_of(range);
            let normal: f64 = StandardNormal.sample(&mut random);
            let point = ray * (range + sigma * normal);
            points.push([point.x, point.y, point.z]);
            sigmas.push(sigma as f32);
        }
    }
    (points, sigmas)
}

/// Two frames of the furnished room with noise and mixed pixels.
pub struct FramePair {
    pub target: (Vec<[f64; 3]>, Vec<f32>),
    pub source: (Vec<[f64; 3]>, Vec<f32>),
    pub target_from_source: Isometry3<f64>,
}

/// Pair `k` of the set that methods are compared on: the camera has moved by 5 to 20 cm and 2 to 8 degrees.
pub fn frame_pair(camera: &Pinhole, k: u64) -> FramePair {
    let scene = Scene::furnished();
    let mut random = Pcg64::seed_from_u64(7_000 + k);
    let mut between = |low: f64, high: f64| low + (high - low) * random.random::<f64>();
    let angle = between(0.0, std::f64::consts::TAU);
    let position = [0.9 * angle.cos(), 0.6 * angle.sin(), between(1.1, 1.7)];
    // Across the room, so that furniture is in view.
    let turned = angle + std::f64::consts::PI + between(-0.6, 0.6);
    let at = [2.2 * turned.cos(), 1.8 * turned.sin(), between(0.3, 0.9)];
    let metre = between(0.05, 0.2);
    let degrees = between(2.0, 8.0);
    let world_from_target = look_at(position, at);
    let target_from_source = disturbance(metre, degrees, 9_000 + k);
    let world_from_source = world_from_target * target_from_source;
    FramePair {
        target: frame_with_mixed_pixels(&scene, camera, &world_from_target, 20_000 + 2 * k),
        source: frame_with_mixed_pixels(&scene, camera, &world_from_source, 20_001 + 2 * k),
        target_from_source,
    }
}

/// A random pose error: `metre` in a random direction, `degrees` about a random axis.
pub fn disturbance(metre: f64, degrees: f64, seed: u64) -> Isometry3<f64> {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut unit = || Vector3::from_fn(|_, _| StandardNormal.sample(&mut random)).normalize();
    let translation = unit() * metre;
    let rotation = UnitQuaternion::from_scaled_axis(unit() * degrees.to_radians());
    Isometry3::from_parts(Translation3::from(translation), rotation)
}

/// Distance in millimetre and angle in degree between two poses.
pub fn pose_error(a: &Isometry3<f64>, b: &Isometry3<f64>) -> (f64, f64) {
    let d = (a.translation.vector - b.translation.vector).norm() * 1e3;
    (d, a.rotation.angle_to(&b.rotation).to_degrees())
}

pub fn point(p: [f64; 3]) -> Point3<f64> {
    Point3::from(p)
}
