//! The scene as rays meet it.

mod closed_form;
mod mesh;
mod texture;

use nalgebra::{Point3, UnitQuaternion, Vector3};

use self::closed_form::{Crossing, Cuboid, Rectangle, Room, Sphere};
use self::mesh::Mesh;
use crate::Result;
use crate::spec::scene::{ObjectSpec, SceneSpec, ShapeSpec, TextureSpec};

/// Where a ray ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hit {
    pub distance_m: f64,
    pub point: Point3<f64>,
    /// Unit normal on the side that the ray comes from.
    pub normal: Vector3<f64>,
    pub albedo: f64,
    /// Index of the object in the description.
    pub object: u32,
}

/// All objects.
pub(crate) struct Scene {
    objects: Vec<Object>,
}

struct Object {
    shape: Shape,
    /// Centre and squared radius of a sphere around the object; a ray that misses it misses the object.
    bound: Option<(Point3<f64>, f64)>,
    albedo: f64,
    texture: Option<TextureSpec>,
}

enum Shape {
    Room(Room, Option<[f64; 6]>),
    Rectangle(Rectangle),
    Sphere(Sphere),
    Cuboid(Cuboid),
    Mesh(Box<Mesh>),
}

impl Scene {
    /// Takes a description that was checked.
    pub fn new(spec: &SceneSpec) -> Result<Self> {
        Ok(Self { objects: spec.objects.iter().map(Object::new).collect::<Result<_>>()? })
    }

    /// The nearest surface along a unit direction.
    pub fn cast(&self, origin: &Point3<f64>, direction: &Vector3<f64>) -> Option<Hit> {
        let mut nearest: Option<(Crossing, usize)> = None;
        for (index, object) in self.objects.iter().enumerate() {
            let Some(crossing) = object.cast(origin, direction) else { continue };
            if nearest.is_none_or(|(best, _)| crossing.distance_m < best.distance_m) {
                nearest = Some((crossing, index));
            }
        }
        let (crossing, index) = nearest?;
        let point = origin + direction * crossing.distance_m;
        let albedo = self.objects[index].albedo_at(&point, &crossing);
        let Crossing { distance_m, normal, .. } = crossing;
        Some(Hit { distance_m, point, normal, albedo, object: index as u32 })
    }

    /// Whether nothing stands on a unit direction nearer than a distance.
    pub fn is_clear(&self, origin: &Point3<f64>, direction: &Vector3<f64>, distance_m: f64) -> bool {
        let blocks = |object: &Object| object.cast(origin, direction).is_some_and(|hit| hit.distance_m < distance_m);
        !self.objects.iter().any(blocks)
    }

    /// The solid object that a point lies in.
    pub fn solid_around(&self, point: &Point3<f64>) -> Option<usize> {
        self.objects.iter().position(|object| match &object.shape {
            Shape::Sphere(sphere) => sphere.contains(point),
            Shape::Cuboid(cuboid) => cuboid.contains(point),
            Shape::Room(..) | Shape::Rectangle(_) | Shape::Mesh(_) => false,
        })
    }
}

impl Object {
    fn new(spec: &ObjectSpec) -> Result<Self> {
        let (shape, bound) = match &spec.shape {
            ShapeSpec::Room { min_m, max_m, face_albedo } => {
                let (low, high) = (Point3::from(*min_m), Point3::from(*max_m));
                (
                    Shape::Room(Room { center: nalgebra::center(&low, &high), half: (high - low) / 2.0 }, *face_albedo),
                    None,
                )
            }
            ShapeSpec::Rectangle { corner_m, edge_u_m, edge_v_m } => {
                let rectangle = Rectangle::new((*corner_m).into(), (*edge_u_m).into(), (*edge_v_m).into());
                (Shape::Rectangle(rectangle), None)
            }
            ShapeSpec::Sphere { center_m, radius_m } => {
                (Shape::Sphere(Sphere { center: (*center_m).into(), radius: *radius_m }), None)
            }
            ShapeSpec::Cuboid { center_m, size_m, rotation_deg } => {
                let [x, y, z] = rotation_deg.map(f64::to_radians);
                let (center, half) = (Point3::from(*center_m), Vector3::from(*size_m) / 2.0);
                // nalgebra's Euler angles are turns about the fixed x, y and z axes in this order.
                let world_from_local = UnitQuaternion::from_euler_angles(x, y, z);
                let bound = Some((center, half.norm_squared()));
                (Shape::Cuboid(Cuboid { center, half, world_from_local }), bound)
            }
            ShapeSpec::Mesh { vertices_m, triangles } => {
                (Shape::Mesh(Box::new(Mesh::new(vertices_m, triangles)?)), None)
            }
        };
        Ok(Self { shape, bound, albedo: spec.albedo, texture: spec.texture })
    }

    fn cast(&self, origin: &Point3<f64>, direction: &Vector3<f64>) -> Option<Crossing> {
        if let Some((center, radius_squared)) = &self.bound {
            let offset = center - origin;
            if offset.cross(direction).norm_squared() > *radius_squared * (1.0 + 1e-9) {
                return None;
            }
        }
        match &self.shape {
            Shape::Room(room, _) => room.cast(origin, direction),
            Shape::Rectangle(rectangle) => rectangle.cast(origin, direction),
            Shape::Sphere(sphere) => sphere.cast(origin, direction),
            Shape::Cuboid(cuboid) => cuboid.cast(origin, direction),
            Shape::Mesh(mesh) => mesh.cast(origin, direction),
        }
    }

    fn albedo_at(&self, point: &Point3<f64>, crossing: &Crossing) -> f64 {
        let base = match &self.shape {
            Shape::Room(_, Some(faces)) => faces[crossing.face],
            _ => self.albedo,
        };
        let Some(texture) = &self.texture else { return base };
        let (point, normal) = match &self.shape {
            Shape::Cuboid(cuboid) => {
                (cuboid.local(point), cuboid.world_from_local.inverse_transform_vector(&crossing.normal))
            }
            Shape::Rectangle(rectangle) => {
                let [u, v] = rectangle.local(point);
                (Vector3::new(u, v, 0.0), Vector3::z())
            }
            Shape::Sphere(sphere) => (point - sphere.center, crossing.normal),
            Shape::Room(..) | Shape::Mesh(_) => (point.coords, crossing.normal),
        };
        base * texture::factor(texture, &point, &normal)
    }
}

#[cfg(test)]
mod tests;
