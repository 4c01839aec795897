//! A room with furniture, near objects and dark patches, seen by a range camera: true jumps everywhere.

use std::f64::consts::TAU;

use phase_unwrap::ImageGeometry;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::Raster;

use crate::{Outcome, Size, files};

/// Ambiguity interval, metres: 30 MHz, rounded.
const INTERVAL_M: f64 = 5.0;
/// Width, height and depth of the room, metres; the camera looks along -z.
const ROOM: Vec3 = [6.0, 3.0, 8.5];
/// Standard deviation of the phase at 5 m and albedo 0.6, radians. It grows as one over the amplitude.
const SIGMA_PHASE: f64 = 0.015;

type Vec3 = [f64; 3];

/// Albedos of the walls and objects.
#[derive(Clone, Copy)]
pub enum Patches {
    /// 0.3 to 0.9.
    Plain,
    /// The same, but one patch in ten is as dark as black cloth, 0.05.
    WithDark,
}

enum Shape {
    Block { low: Vec3, high: Vec3 },
    Sphere { centre: Vec3, radius: f64 },
}

pub struct Room {
    size: Size,
    eye: Vec3,
    yaw: f64,
    patches: Patches,
    cell: f64,
    seed: u64,
    objects: Vec<Shape>,
}

pub struct View {
    pub phase: Raster<f32>,
    pub amplitude: Raster<f32>,
    /// True phase, not wrapped, and the same with the noise of `phase`.
    pub truth: Raster<f32>,
    pub noisy: Raster<f32>,
}

impl View {
    pub fn write(&self, folder: &str) -> Outcome {
        files::write(folder, "phase.f32", &self.phase)?;
        files::write(folder, "amplitude.f32", &self.amplitude)?;
        files::write(folder, "truth.f32", &self.truth)?;
        files::write(folder, "noisy.f32", &self.noisy)
    }
}

impl Room {
    pub fn new(seed: u64, patches: Patches, size: Size) -> Self {
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut between = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
        let eye = [between(1.5, 4.5), between(1.2, 1.8), between(7.4, 8.2)];
        let (yaw, cell) = (between(-0.3, 0.3), between(0.4, 1.2));
        let mut objects = Vec::new();
        for _ in 0..6 {
            let low = [between(0.0, 5.0), 0.0, between(0.3, 5.5)];
            let high = [low[0] + between(0.3, 1.2), between(0.4, 1.6), low[2] + between(0.3, 1.0)];
            objects.push(Shape::Block { low, high });
        }
        let mut room = Self { size, eye, yaw, patches, cell, seed, objects };
        for _ in 0..4 {
            let ray = room.ray(between(0.1, 0.9) * size[0] as f64, between(0.1, 0.9) * size[1] as f64);
            let (range, radius) = (between(0.8, 1.6), between(0.05, 0.15));
            room.objects.push(Shape::Sphere { centre: along(eye, ray, range), radius });
        }
        room
    }

    pub fn geometry(&self) -> ImageGeometry {
        let [col, row] = self.size.map(|size| (size as f32 - 1.0) / 2.0);
        ImageGeometry { principal_distance_px: self.principal_distance() as f32, principal_point_px: [col, row] }
    }

    fn principal_distance(&self) -> f64 {
        1.1 * self.size[0] as f64
    }

    /// Unit direction through a pixel.
    fn ray(&self, col: f64, row: f64) -> Vec3 {
        let [cx, cy] = self.size.map(|size| (size as f64 - 1.0) / 2.0);
        let (x, y, z) = (col - cx, cy - row, -self.principal_distance());
        let norm = (x * x + y * y + z * z).sqrt();
        let (sin, cos) = self.yaw.sin_cos();
        [(cos * x + sin * z) / norm, y / norm, (cos * z - sin * x) / norm]
    }

    /// Range in metres and `albedo * cos(incidence)` at a pixel.
    pub fn look(&self, col: usize, row: usize) -> (f64, f64) {
        let ray = self.ray(col as f64, row as f64);
        let (mut range, mut cosine) = self.wall(ray);
        for object in &self.objects {
            if let Some((t, c)) = object.hit(self.eye, ray).filter(|hit| hit.0 < range) {
                (range, cosine) = (t, c);
            }
        }
        (range, cosine * self.albedo(along(self.eye, ray, range)))
    }

    fn wall(&self, ray: Vec3) -> (f64, f64) {
        let exit = |axis: usize| {
            let end = if ray[axis] > 0.0 { ROOM[axis] } else { 0.0 };
            ((end - self.eye[axis]) / ray[axis], ray[axis].abs())
        };
        [exit(1), exit(2)].into_iter().fold(exit(0), |best, next| if next.0 < best.0 { next } else { best })
    }

    fn albedo(&self, point: Vec3) -> f64 {
        let cells = point.map(|x| (x / self.cell + 1e-6).floor() as i64 as u64);
        let key =
            cells.iter().fold(self.seed, |key, cell| key.wrapping_mul(1_000_003) ^ cell.wrapping_add(0x9e37_79b9));
        let dice = Pcg64::seed_from_u64(key).random::<f64>();
        match self.patches {
            Patches::WithDark if dice < 0.1 => 0.05,
            Patches::WithDark | Patches::Plain => 0.3 + 0.6 * dice,
        }
    }

    /// The view with noise.
    pub fn view(&self, seed: u64) -> View {
        let mut rng = Pcg64::seed_from_u64(seed);
        // Any unit will do for amplitudes.
        let gain = 4000.0;
        let sigma = SIGMA_PHASE * gain * 0.6 / 25.0;
        let plane = || Raster::filled(self.size[0], self.size[1], 0.0_f32);
        let mut view = View { phase: plane(), amplitude: plane(), truth: plane(), noisy: plane() };
        for row in 0..self.size[1] {
            for col in 0..self.size[0] {
                let (range, reflectance) = self.look(col, row);
                let (truth, amplitude) = (TAU * range / INTERVAL_M, gain * reflectance / (range * range));
                let mut noise = || -> f64 { StandardNormal.sample(&mut rng) };
                let (along, across) = (amplitude + sigma * noise(), sigma * noise());
                let noisy = truth + across.atan2(along);
                view.phase[(col, row)] = (noisy.rem_euclid(TAU) as f32).min(std::f32::consts::TAU);
                view.amplitude[(col, row)] = along.hypot(across) as f32;
                view.truth[(col, row)] = truth as f32;
                view.noisy[(col, row)] = noisy as f32;
            }
        }
        view
    }
}

impl Shape {
    /// Distance of the first hit and cosine of the incidence.
    fn hit(&self, eye: Vec3, ray: Vec3) -> Option<(f64, f64)> {
        match *self {
            Self::Sphere { centre, radius } => {
                let from = [0, 1, 2].map(|axis| eye[axis] - centre[axis]);
                let half = dot(from, ray);
                let square = half * half - dot(from, from) + radius * radius;
                (square > 0.0 && half < 0.0).then(|| (-half - square.sqrt(), square.sqrt() / radius))
            }
            Self::Block { low, high } => {
                let (mut near, mut far, mut cosine) = (0.0, f64::INFINITY, 0.0);
                for axis in 0..3 {
                    let ends = [low[axis], high[axis]].map(|end| (end - eye[axis]) / ray[axis]);
                    let (one, two) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
                    if one > near {
                        (near, cosine) = (one, ray[axis].abs());
                    }
                    far = f64::min(far, two);
                }
                (near < far && cosine > 0.0).then_some((near, cosine))
            }
        }
    }
}

fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn along(from: Vec3, direction: Vec3, distance: f64) -> Vec3 {
    [0, 1, 2].map(|axis| from[axis] + distance * direction[axis])
}
