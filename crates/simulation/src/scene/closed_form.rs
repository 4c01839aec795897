//! Rays against shapes with a closed form. A distance is along the unit direction, metre.

use nalgebra::{Point3, UnitQuaternion, Vector3};

/// Nearest distance that counts as a hit: a ray that starts on a surface does not meet it again.
pub(crate) const NEAREST_M: f64 = 1e-9;

/// Where a ray meets a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Crossing {
    pub distance_m: f64,
    /// Unit normal in the world, on the side that the ray comes from.
    pub normal: Vector3<f64>,
    /// Number of the face: `2 axis + (1 at the higher end)` for boxes, zero elsewhere.
    pub face: usize,
}

/// Distances at which a line enters and leaves the box `|coordinate| <= half`, with the faces that it crosses.
struct Slab {
    enter: (f64, usize),
    leave: (f64, usize),
}

fn slab(origin: &Vector3<f64>, direction: &Vector3<f64>, half: &Vector3<f64>) -> Option<Slab> {
    let mut found = Slab { enter: (f64::NEG_INFINITY, 0), leave: (f64::INFINITY, 0) };
    for axis in 0..3 {
        let (o, d, h) = (origin[axis], direction[axis], half[axis]);
        if d == 0.0 {
            if o.abs() > h {
                return None;
            }
            continue;
        }
        let towards_higher = usize::from(d > 0.0);
        let near = (-h.copysign(d) - o) / d;
        let far = (h.copysign(d) - o) / d;
        if near > found.enter.0 {
            found.enter = (near, 2 * axis + 1 - towards_higher);
        }
        if far < found.leave.0 {
            found.leave = (far, 2 * axis + towards_higher);
        }
    }
    (found.enter.0 <= found.leave.0).then_some(found)
}

fn axis_of(face: usize) -> usize {
    face / 2
}

/// The unit vector that points out of a box's face.
fn outward(face: usize) -> Vector3<f64> {
    let mut normal = Vector3::zeros();
    normal[axis_of(face)] = if face.is_multiple_of(2) { -1.0 } else { 1.0 };
    normal
}

/// The inner faces of an axis-parallel box. They are seen from inside only, so the far crossing counts.
#[derive(Debug, Clone)]
pub(crate) struct Room {
    pub center: Point3<f64>,
    pub half: Vector3<f64>,
}

impl Room {
    pub fn cast(&self, origin: &Point3<f64>, direction: &Vector3<f64>) -> Option<Crossing> {
        let (distance_m, face) = slab(&(origin - self.center), direction, &self.half)?.leave;
        (distance_m > NEAREST_M).then(|| Crossing { distance_m, normal: -outward(face), face })
    }
}

/// A solid box. From inside, its inner faces are seen.
#[derive(Debug, Clone)]
pub(crate) struct Cuboid {
    pub center: Point3<f64>,
    pub half: Vector3<f64>,
    pub world_from_local: UnitQuaternion<f64>,
}

impl Cuboid {
    pub fn cast(&self, origin: &Point3<f64>, direction: &Vector3<f64>) -> Option<Crossing> {
        let origin = self.local(origin);
        let direction = self.world_from_local.inverse_transform_vector(direction);
        let Slab { enter, leave } = slab(&origin, &direction, &self.half)?;
        let (distance_m, face, normal) = if enter.0 > NEAREST_M {
            (enter.0, enter.1, outward(enter.1))
        } else {
            (leave.0, leave.1, -outward(leave.1))
        };
        let crossing = || Crossing { distance_m, normal: self.world_from_local * normal, face };
        (distance_m > NEAREST_M).then(crossing)
    }

    pub fn local(&self, point: &Point3<f64>) -> Vector3<f64> {
        self.world_from_local.inverse_transform_vector(&(point - self.center))
    }

    pub fn contains(&self, point: &Point3<f64>) -> bool {
        let local = self.local(point);
        (0..3).all(|axis| local[axis].abs() <= self.half[axis])
    }
}

/// A sphere.
#[derive(Debug, Clone)]
pub(crate) struct Sphere {
    pub center: Point3<f64>,
    pub radius: f64,
}

impl Sphere {
    pub fn cast(&self, origin: &Point3<f64>, direction: &Vector3<f64>) -> Option<Crossing> {
        let from_center = origin - self.center;
        let along = from_center.dot(direction);
        // The part of the offset across the ray: exact for far spheres, where |offset|^2 - along^2 cancels.
        let across = from_center - direction * along;
        let half_chord_squared = self.radius * self.radius - across.norm_squared();
        if half_chord_squared < 0.0 {
            return None;
        }
        let half_chord = half_chord_squared.sqrt();
        let (near, far) = (-along - half_chord, -along + half_chord);
        let distance_m = if near > NEAREST_M { near } else { far };
        let outward = (from_center + direction * distance_m) / self.radius;
        let normal = if near > NEAREST_M { outward } else { -outward };
        (distance_m > NEAREST_M).then_some(Crossing { distance_m, normal, face: 0 })
    }

    pub fn contains(&self, point: &Point3<f64>) -> bool {
        (point - self.center).norm() <= self.radius
    }
}

/// A rectangle, seen from both sides.
#[derive(Debug, Clone)]
pub(crate) struct Rectangle {
    pub corner: Point3<f64>,
    pub axis_u: Vector3<f64>,
    pub axis_v: Vector3<f64>,
    pub normal: Vector3<f64>,
    pub size: [f64; 2],
}

impl Rectangle {
    pub fn new(corner: Point3<f64>, edge_u: Vector3<f64>, edge_v: Vector3<f64>) -> Self {
        let size = [edge_u.norm(), edge_v.norm()];
        let (axis_u, axis_v) = (edge_u / size[0], edge_v / size[1]);
        Self { corner, axis_u, axis_v, normal: axis_u.cross(&axis_v).normalize(), size }
    }

    pub fn cast(&self, origin: &Point3<f64>, direction: &Vector3<f64>) -> Option<Crossing> {
        let falling = self.normal.dot(direction);
        if falling == 0.0 {
            return None;
        }
        let distance_m = self.normal.dot(&(self.corner - origin)) / falling;
        let [u, v] = self.local(&(origin + direction * distance_m));
        let inside = (0.0..=self.size[0]).contains(&u) && (0.0..=self.size[1]).contains(&v);
        let normal = if falling < 0.0 { self.normal } else { -self.normal };
        (distance_m > NEAREST_M && inside).then_some(Crossing { distance_m, normal, face: 0 })
    }

    /// Distances from the corner along both edges.
    pub fn local(&self, point: &Point3<f64>) -> [f64; 2] {
        let offset = point - self.corner;
        [offset.dot(&self.axis_u), offset.dot(&self.axis_v)]
    }
}
