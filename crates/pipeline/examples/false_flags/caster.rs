//! A second room, independent of the crate `simulation`: its own rays, shapes, textures, light and noise. No light is
//! scattered in the lens; pixels at edges are mixed by rays side by side.

use std::f64::consts::TAU;

use rand_distr::{Distribution, Normal, Poisson};
use rand_pcg::Pcg64;

const LIGHT_M_PER_S: f64 = 299_792_458.0;

/// Rays along each side of a pixel.
const RAYS: usize = 4;

/// A ray that leaves the plane through what the pixel's centre sees by more than this makes the pixel mixed, metre.
pub const MIXED_M: f64 = 0.02;

type Vector = [f64; 3];

fn add(a: Vector, b: Vector, times: f64) -> Vector {
    std::array::from_fn(|i| a[i] + times * b[i])
}

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn unit(a: Vector) -> Vector {
    a.map(|part| part / dot(a, a).sqrt())
}

/// What reflects; x to the right, y to the back, z upward, metre.
pub enum Shape {
    /// A plane by a point and its normal.
    Plane(Vector, Vector),
    /// Centre and radius.
    Sphere(Vector, f64),
    /// Upright: foot's centre, radius, height.
    Column(Vector, f64, f64),
    /// Centre, half lengths, and its turn about the vertical in degree.
    Block(Vector, Vector, f64),
}

/// What it looks like, from the place hit.
#[derive(Clone, Copy)]
pub enum Paint {
    /// One albedo.
    Plain(f64),
    /// Two albedos in stripes of a width along a direction.
    Stripes([f64; 2], f64, Vector),
    /// Bricks of this albedo, each a little its own, with darker joints.
    Bricks(f64),
    /// Albedo between two values, grain by grain of this size.
    Grain([f64; 2], f64),
}

struct Hit {
    range: f64,
    normal: Vector,
    albedo: f64,
}

impl Shape {
    /// The nearest place in front of `from` along a unit vector: distance and normal.
    fn hit(&self, from: Vector, along: Vector) -> Option<(f64, Vector)> {
        match *self {
            Self::Plane(point, normal) => {
                let distance = dot(add(point, from, -1.0), normal) / dot(along, normal);
                (distance > 1e-6).then_some((distance, normal))
            }
            Self::Sphere(center, radius) => {
                let to = add(center, from, -1.0);
                let nearest = dot(to, along);
                let inside = radius * radius - dot(to, to) + nearest * nearest;
                let distance = nearest - inside.max(0.0).sqrt();
                let normal = add(add(from, along, distance), center, -1.0).map(|part| part / radius);
                (inside > 0.0 && distance > 1e-6).then_some((distance, normal))
            }
            Self::Column(foot, radius, height) => {
                let (to, flat) = (add(foot, from, -1.0), along[0].hypot(along[1]));
                let [x, y] = [along[0] / flat, along[1] / flat];
                let nearest = to[0] * x + to[1] * y;
                let inside = radius * radius - to[0] * to[0] - to[1] * to[1] + nearest * nearest;
                let distance = (nearest - inside.max(0.0).sqrt()) / flat;
                let place = add(from, along, distance);
                let normal = [(place[0] - foot[0]) / radius, (place[1] - foot[1]) / radius, 0.0];
                let within = (foot[2]..foot[2] + height).contains(&place[2]);
                (inside > 0.0 && distance > 1e-6 && within).then_some((distance, normal))
            }
            Self::Block(center, half, turn_deg) => {
                let (sin, cos) = turn_deg.to_radians().sin_cos();
                let axes = [[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]];
                let to = add(center, from, -1.0);
                let (mut near, mut far, mut face) = (f64::NEG_INFINITY, f64::INFINITY, [0.0; 3]);
                for (axis, half) in axes.into_iter().zip(half) {
                    let (middle, speed) = (dot(to, axis), dot(along, axis));
                    let enter = (middle - half * speed.signum()) / speed;
                    far = far.min((middle + half * speed.signum()) / speed);
                    if enter > near {
                        (near, face) = (enter, axis);
                    }
                }
                (near > 1e-6 && near < far).then_some((near, face))
            }
        }
    }
}

impl Paint {
    fn albedo(self, [x, y, z]: Vector) -> f64 {
        // A number from 0 to 1 for each cell, without any order.
        let chance = |cell: [f64; 3]| {
            ((12.9898 * cell[0] + 78.233 * cell[1] + 37.719 * cell[2]).sin() * 43_758.545_3).rem_euclid(1.0)
        };
        match self {
            Self::Plain(albedo) => albedo,
            Self::Stripes(albedos, width, along) => {
                albedos[usize::from((dot([x, y, z], along) / width).rem_euclid(2.0) >= 1.0)]
            }
            Self::Bricks(albedo) => {
                let course = (z / 0.12).floor();
                let along = (x + y) / 0.25 + 0.5 * course.rem_euclid(2.0);
                let joint = (z / 0.12).rem_euclid(1.0) < 0.12 || along.rem_euclid(1.0) < 0.06;
                albedo * if joint { 0.6 } else { 0.8 + 0.4 * chance([along.floor(), course, 0.0]) }
            }
            Self::Grain([low, high], size) => {
                low + (high - low) * chance([x, y, z].map(|part| (part / size + 0.01).floor()))
            }
        }
    }
}

/// Where a camera stands and looks.
pub struct Station {
    pub name: &'static str,
    pub position: Vector,
    pub target: Vector,
}

/// The camera and its light.
pub struct Camera {
    pub width: usize,
    pub height: usize,
    pub principal_distance_px: f64,
    pub modulation_hz: Vec<f64>,
    /// Amplitude of a white surface at 1 m on the axis.
    pub power: f64,
    /// Modulated part of the own light; sunlight as part of the own light at 1 m.
    pub contrast: f64,
    pub sun: f64,
    /// Units a photoelectron makes, and noise without light.
    pub gain: f64,
    pub dark_sigma: f64,
    /// Highest sample.
    pub saturation: f64,
}

/// What a station sees, without noise; pixel by pixel in rows from the top.
pub struct Image {
    pub range: Vec<f32>,
    pub mixed: Vec<bool>,
    pub offset: Vec<f64>,
    /// Real and imaginary part for each frequency.
    pub light: Vec<Vec<[f64; 2]>>,
}

/// Shapes with their paint, all lengths `scale` times as long.
pub struct Room {
    pub shapes: Vec<(Shape, Paint)>,
    pub scale: f64,
}

impl Room {
    fn cast(&self, from: Vector, along: Vector) -> Option<Hit> {
        let hits = self.shapes.iter().filter_map(|(shape, paint)| shape.hit(from, along).map(|hit| (hit, paint)));
        let ((range, normal), paint) = hits.min_by(|a, b| a.0.0.total_cmp(&b.0.0))?;
        let normal = if dot(normal, along) > 0.0 { normal.map(|part| -part) } else { normal };
        Some(Hit { range: self.scale * range, normal, albedo: paint.albedo(add(from, along, range)) })
    }

    /// Renders what the camera sees from a station.
    pub fn render(&self, camera: &Camera, station: &Station) -> Image {
        let forward = unit(add(station.target, station.position, -1.0));
        let right = unit(cross(forward, [0.0, 0.0, 1.0]));
        let up = cross(right, forward);
        let pixels = camera.width * camera.height;
        let mut image = Image {
            range: vec![f32::NAN; pixels],
            mixed: vec![false; pixels],
            offset: vec![0.0; pixels],
            light: vec![vec![[0.0; 2]; pixels]; camera.modulation_hz.len()],
        };
        let middle = [(camera.width as f64 - 1.0) / 2.0, (camera.height as f64 - 1.0) / 2.0];
        let direction = |col: f64, row: f64| {
            let [x, y] =
                [(col - middle[0]) / camera.principal_distance_px, (middle[1] - row) / camera.principal_distance_px];
            unit(add(add(forward, right, x), up, y))
        };
        for pixel in 0..pixels {
            let (col, row) = ((pixel % camera.width) as f64, (pixel / camera.width) as f64);
            let center = self.cast(station.position, direction(col, row));
            image.range[pixel] = center.as_ref().map_or(f32::NAN, |hit| hit.range as f32);
            let beside = |index: usize| (index as f64 + 0.5) / RAYS as f64 - 0.5;
            for ray in 0..RAYS * RAYS {
                let along = direction(col + beside(ray % RAYS), row + beside(ray / RAYS));
                let hit = self.cast(station.position, along);
                image.mixed[pixel] |= leaves(direction(col, row), center.as_ref(), along, hit.as_ref());
                let Some(hit) = hit else { continue };
                let facing = -dot(hit.normal, along) * dot(along, forward).powi(2) / (RAYS * RAYS) as f64;
                let amplitude = camera.power * hit.albedo * facing / (hit.range * hit.range);
                let sun = camera.power * camera.sun * hit.albedo / (RAYS * RAYS) as f64;
                image.offset[pixel] += amplitude / camera.contrast + sun;
                for (plane, frequency) in image.light.iter_mut().zip(&camera.modulation_hz) {
                    let (sin, cos) = (2.0 * TAU * frequency * hit.range / LIGHT_M_PER_S).sin_cos();
                    plane[pixel][0] += amplitude * cos;
                    plane[pixel][1] += amplitude * sin;
                }
            }
        }
        image
    }
}

/// Whether a ray leaves the plane that touches the surface at the pixel's centre.
fn leaves(axis: Vector, center: Option<&Hit>, along: Vector, hit: Option<&Hit>) -> bool {
    match (center, hit) {
        (Some(center), Some(hit)) => {
            let expected = center.range * dot(axis, center.normal) / dot(along, center.normal);
            (hit.range - expected).abs() > MIXED_M
        }
        (None, None) => false,
        _ => true,
    }
}

impl Image {
    /// Samples `[F, 4, H, W]` of one frame: shot noise of whole photoelectrons, noise without light, whole numbers.
    pub fn samples(&self, camera: &Camera, seed: u64, frame: usize) -> Vec<u16> {
        let mut random = Pcg64::new(u128::from(seed) << 64 | frame as u128, 0x5eed);
        let dark = Normal::new(0.0, camera.dark_sigma).ok();
        let mut out = Vec::with_capacity(4 * self.light.len() * self.offset.len());
        for plane in &self.light {
            for step in 0..4 {
                let (sin, cos) = (TAU * f64::from(step) / 4.0).sin_cos();
                for ([re, im], offset) in plane.iter().zip(&self.offset) {
                    let light = (offset + re * cos - im * sin).max(0.0);
                    let electrons =
                        Poisson::new(light / camera.gain).map_or(0.0, |poisson| poisson.sample(&mut random));
                    let noise = dark.map_or(0.0, |dark| dark.sample(&mut random));
                    out.push((camera.gain * electrons + noise).round().clamp(0.0, camera.saturation) as u16);
                }
            }
        }
        out
    }
}
