//! A room with a box, a thin wall and a sphere, by analytic ray casting.

use fusion::nalgebra::{Point3, Vector3};

/// A rectangle along the axes, seen from one side.
#[derive(Debug, Clone, Copy)]
pub struct Face {
    pub axis: usize,
    /// The side that it is seen from: 1 or -1 along the axis.
    pub side: f64,
    pub at: f64,
    pub low: Vector3<f64>,
    pub high: Vector3<f64>,
}

pub struct Scene {
    pub faces: Vec<Face>,
    pub sphere: (Point3<f64>, f64),
}

/// Number of the surface that stands for the sphere.
pub const SPHERE: usize = 1000;
/// Faces of the thin wall's two sides.
pub const THIN: [usize; 2] = [6, 7];

fn solid(faces: &mut Vec<Face>, low: [f64; 3], high: [f64; 3], outward: f64) {
    for axis in 0..3 {
        for (at, side) in [(low[axis], -outward), (high[axis], outward)] {
            faces.push(Face { axis, side, at, low: low.into(), high: high.into() });
        }
    }
}

impl Scene {
    pub fn room() -> Self {
        let mut faces = Vec::new();
        solid(&mut faces, [0.0, 0.0, 0.0], [4.0, 3.0, 2.5], -1.0);
        solid(&mut faces, [1.5, 1.8, 0.0], [1.55, 3.0, 1.8], 1.0);
        solid(&mut faces, [0.6, 0.5, 0.0], [1.2, 1.1, 0.7], 1.0);
        Self { faces, sphere: (Point3::new(2.6, 1.2, 0.9), 0.4) }
    }

    /// Range and surface that a ray meets first.
    pub fn cast(&self, from: &Point3<f64>, ray: &Vector3<f64>) -> Option<(f64, usize)> {
        let mut best: Option<(f64, usize)> = None;
        let mut offer = |range: f64, surface: usize| {
            if range > 1e-6 && best.is_none_or(|(nearest, _)| range < nearest) {
                best = Some((range, surface));
            }
        };
        for (number, face) in self.faces.iter().enumerate() {
            if ray[face.axis] * face.side < 0.0 {
                let range = (face.at - from[face.axis]) / ray[face.axis];
                if face.holds(&(from + ray * range), 0.0) {
                    offer(range, number);
                }
            }
        }
        let apart = from - self.sphere.0;
        let (half, rest) = (apart.dot(ray), apart.norm_squared() - self.sphere.1.powi(2));
        if half * half > rest {
            offer(-half - (half * half - rest).sqrt(), SPHERE);
        }
        best
    }

    /// How far a point lies in front of the surface behind its normal, and which that is: the nearest within 0.2 m.
    pub fn above(&self, point: &Point3<f64>, normal: &Vector3<f64>) -> Option<(f64, usize)> {
        let mut best: Option<(f64, usize)> = None;
        let mut offer = |height: f64, surface: usize| {
            if height.abs() < best.map_or(0.2, |(nearest, _)| nearest.abs()) {
                best = Some((height, surface));
            }
        };
        for (number, face) in self.faces.iter().enumerate() {
            let along = normal[face.axis];
            if along * face.side > 0.3 {
                let height = (point[face.axis] - face.at) / along;
                if face.holds(&(point - normal * height), 0.03) {
                    offer(height, number);
                }
            }
        }
        let apart = point - self.sphere.0;
        let half = apart.dot(normal);
        let inside = half * half - apart.norm_squared() + self.sphere.1.powi(2);
        if inside > 0.0 && half > 0.0 {
            offer(half - inside.sqrt(), SPHERE);
        }
        best
    }
}

impl Face {
    /// Whether the rectangle holds a point of its plane, or one so far beside it.
    pub fn holds(&self, point: &Point3<f64>, margin: f64) -> bool {
        (0..3).filter(|k| *k != self.axis).all(|k| point[k] > self.low[k] - margin && point[k] < self.high[k] + margin)
    }
}
