//! A small renderer: a room with furniture and near objects, seen by a range camera of one frequency.
#![allow(dead_code)]

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::Raster;

pub const WIDTH: usize = 176;
pub const HEIGHT: usize = 144;
/// Ambiguity interval at 30 MHz, metres (rounded; only ratios matter here).
pub const INTERVAL_M: f64 = 5.0;
/// Principal distance in pixels: 8 mm at a pitch of 0.04 mm.
pub const FOCAL_PX: f64 = 200.0;
/// Subrays a side of a pixel, averaged as complex numbers: mixed pixels at edges.
const SUBRAYS: usize = 3;

type Vec3 = [f64; 3];

#[derive(Clone, Copy)]
enum Shape {
    /// Axis-aligned box seen from outside.
    Block {
        low: Vec3,
        high: Vec3,
    },
    Sphere {
        centre: Vec3,
        radius: f64,
    },
}

#[derive(Clone, Copy)]
enum Albedo {
    /// Patches of `cell` metres with values 0.3 to 0.9.
    Patches {
        cell: f64,
        seed: u64,
    },
    Plain(f64),
}

pub struct Scene {
    room: Vec3,
    wall: Albedo,
    objects: Vec<(Shape, Albedo)>,
    position: Vec3,
    yaw: f64,
    pitch: f64,
}

pub struct View {
    pub phase: Raster<f32>,
    pub amplitude: Raster<f32>,
    /// Range of the ray through the pixel's centre, in ambiguity intervals.
    pub cycles: Raster<f64>,
    /// The count that brings the measured phase next to the true range.
    pub wraps: Raster<i32>,
    /// Pixels whose subrays meet ranges that differ by more than 0.2 m.
    pub mixed: Raster<bool>,
}

fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}
fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
fn along(origin: Vec3, direction: Vec3, t: f64) -> Vec3 {
    [0, 1, 2].map(|axis| origin[axis] + t * direction[axis])
}

fn hash(mut x: u64) -> f64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((x ^ (x >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

impl Albedo {
    fn at(self, point: Vec3) -> f64 {
        match self {
            Self::Plain(value) => value,
            Self::Patches { cell, seed } => {
                let cells = point.map(|x| (x / cell + 1e-6).floor() as i64 as u64);
                let key = cells.iter().fold(seed, |key, c| key.wrapping_mul(1_000_003) ^ c.wrapping_mul(0x9e37_79b9));
                0.3 + 0.6 * hash(key)
            }
        }
    }
}

impl Shape {
    /// Distance and outward normal of the first hit.
    fn hit(&self, origin: Vec3, direction: Vec3) -> Option<(f64, Vec3)> {
        match *self {
            Self::Sphere { centre, radius } => {
                let from = sub(origin, centre);
                let half = dot(from, direction);
                let root = (half * half - dot(from, from) + radius * radius).max(-1.0);
                let t = -half - if root < 0.0 { return None } else { root.sqrt() };
                let normal = sub(along(origin, direction, t), centre).map(|x| x / radius);
                (t > 0.0).then_some((t, normal))
            }
            Self::Block { low, high } => {
                let (mut near, mut far, mut axis) = (0.0, f64::INFINITY, 3);
                for a in 0..3 {
                    let (mut one, mut two) =
                        ((low[a] - origin[a]) / direction[a], (high[a] - origin[a]) / direction[a]);
                    if one > two {
                        std::mem::swap(&mut one, &mut two);
                    }
                    if one > near {
                        (near, axis) = (one, a);
                    }
                    far = f64::min(far, two);
                }
                if near > far || axis == 3 {
                    return None;
                }
                let mut normal = [0.0; 3];
                normal[axis] = -direction[axis].signum();
                Some((near, normal))
            }
        }
    }
}

impl Scene {
    /// A room of 6 x 8.5 x 3 m (x, z, y) with furniture on the floor and near objects before the camera, some of them
    /// retro-reflective. Everything follows from the seed.
    pub fn random(seed: u64) -> Self {
        let mut rng = Pcg64::seed_from_u64(seed);
        let room = [6.0, 3.0, 8.5];
        let mut between = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
        // From a place near a wall across the room, so that walls lie at 2 to 9 m.
        let position = [between(1.0, 5.0), between(1.2, 1.8), between(7.2, 8.2)];
        let yaw = between(-0.45, 0.45);
        let pitch = between(-0.25, 0.05);
        let wall = Albedo::Patches { cell: between(0.4, 1.5), seed: seed.wrapping_mul(77) };
        let mut objects = Vec::new();
        for n in 0..6 {
            let low = [between(0.0, 5.0), 0.0, between(0.3, 5.5)];
            let high = [low[0] + between(0.3, 1.2), between(0.4, 1.6), low[2] + between(0.3, 1.0)];
            objects.push((Shape::Block { low, high }, Albedo::Patches { cell: 0.7, seed: seed * 31 + n }));
        }
        let mut scene = Self { room, wall, objects, position, yaw, pitch };
        for n in 0..4 {
            let direction = scene.direction(between(15.0, 160.0), between(15.0, 128.0));
            let centre = along(position, direction, between(0.8, 1.5));
            let albedo = if n % 2 == 0 { between(2.0, 5.0) } else { between(0.3, 0.9) };
            let size = between(0.04, 0.12);
            let shape = if n < 2 {
                Shape::Sphere { centre, radius: size }
            } else {
                Shape::Block { low: centre.map(|x| x - size), high: centre.map(|x| x + 0.7 * size) }
            };
            scene.objects.push((shape, Albedo::Plain(albedo)));
        }
        scene
    }

    /// Unit direction of the ray through a pixel position; the camera looks along -z when yaw and pitch are zero.
    fn direction(&self, col: f64, row: f64) -> Vec3 {
        let x = col - (WIDTH as f64 - 1.0) / 2.0;
        let y = (HEIGHT as f64 - 1.0) / 2.0 - row;
        let norm = (x * x + y * y + FOCAL_PX * FOCAL_PX).sqrt();
        let [x, y, z] = [x / norm, y / norm, -FOCAL_PX / norm];
        let (sin, cos) = self.pitch.sin_cos();
        let [x, y, z] = [x, cos * y - sin * z, sin * y + cos * z];
        let (sin, cos) = self.yaw.sin_cos();
        [cos * x + sin * z, y, -sin * x + cos * z]
    }

    /// Range in metres and `albedo * cos(incidence)` along a ray.
    fn trace(&self, direction: Vec3) -> (f64, f64) {
        let exits = [0, 1, 2].map(|a| {
            let end = if direction[a] > 0.0 { self.room[a] } else { 0.0 };
            (end - self.position[a]) / direction[a]
        });
        let axis = (0..3).min_by(|&a, &b| exits[a].total_cmp(&exits[b])).unwrap();
        let mut best = (exits[axis], direction[axis].abs(), self.wall);
        for (shape, albedo) in &self.objects {
            if let Some((t, normal)) = shape.hit(self.position, direction)
                && t < best.0
            {
                best = (t, dot(normal, direction).abs(), *albedo);
            }
        }
        (best.0, best.2.at(along(self.position, direction, best.0)) * best.1)
    }

    /// Renders with complex noise such that the phase of a surface of albedo 0.6 at 5 m has `sigma_phase_rad`.
    pub fn view(&self, seed: u64, sigma_phase_rad: f64) -> View {
        let mut rng = Pcg64::seed_from_u64(seed);
        // Camera gain: any unit will do.
        let gain = 4000.0;
        let sigma = sigma_phase_rad * gain * 0.6 / 25.0;
        let mut phase = Raster::filled(WIDTH, HEIGHT, 0.0_f32);
        let mut amplitude = phase.clone();
        let mut cycles = Raster::filled(WIDTH, HEIGHT, 0.0);
        let mut wraps = Raster::filled(WIDTH, HEIGHT, 0);
        let mut mixed = Raster::filled(WIDTH, HEIGHT, false);
        for row in 0..HEIGHT {
            for col in 0..WIDTH {
                let at = (col, row);
                let (re, im, spread) = self.pixel(col as f64, row as f64, gain);
                let noise = |rng: &mut Pcg64| -> f64 { StandardNormal.sample(rng) };
                let (re, im) = (re + sigma * noise(&mut rng), im + sigma * noise(&mut rng));
                let angle = im.atan2(re).rem_euclid(TAU) as f32;
                phase[at] = if angle >= TAU as f32 { 0.0 } else { angle };
                amplitude[at] = re.hypot(im) as f32;
                cycles[at] = self.trace(self.direction(col as f64, row as f64)).0 / INTERVAL_M;
                wraps[at] = (cycles[at] - f64::from(phase[at]) / TAU).round() as i32;
                mixed[at] = spread > 0.2;
            }
        }
        View { phase, amplitude, cycles, wraps, mixed }
    }

    fn pixel(&self, col: f64, row: f64, gain: f64) -> (f64, f64, f64) {
        let (mut re, mut im, mut near, mut far) = (0.0, 0.0, f64::INFINITY, 0.0_f64);
        for sub in 0..SUBRAYS * SUBRAYS {
            let offset = |n: usize| (n as f64 + 0.5) / SUBRAYS as f64 - 0.5;
            let (dc, dr) = (offset(sub % SUBRAYS), offset(sub / SUBRAYS));
            let (range, reflectance) = self.trace(self.direction(col + dc, row + dr));
            let amplitude = gain * reflectance / (range * range) / (SUBRAYS * SUBRAYS) as f64;
            let (sin, cos) = (TAU * range / INTERVAL_M).sin_cos();
            re += amplitude * cos;
            im += amplitude * sin;
            near = near.min(range);
            far = far.max(range);
        }
        (re, im, far - near)
    }
}
