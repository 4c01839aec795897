//! The bridge to parry, whose own vectors (glam) do not leave this module.

use nalgebra::{Point3, Vector3};
use parry3d_f64::math::Vector as ParryVector;
use parry3d_f64::query::{Ray, RayCast};
use parry3d_f64::shape::TriMesh;

use super::closed_form::{Crossing, NEAREST_M};
use crate::{Error, Result};

/// Triangles with parry's tree over them, seen from both sides.
#[derive(Clone)]
pub(crate) struct Mesh(TriMesh);

fn parry(v: &Vector3<f64>) -> ParryVector {
    ParryVector::new(v.x, v.y, v.z)
}

impl Mesh {
    /// Builds the tree. The indices must have been checked against the corners.
    pub fn new(vertices_m: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<Self> {
        let vertices = vertices_m.iter().map(|v| ParryVector::new(v[0], v[1], v[2])).collect();
        let mesh = TriMesh::new(vertices, triangles.to_vec()).map_err(|error| Error::Field {
            field: "scene.objects: triangles of a mesh".into(),
            value: error.to_string(),
            expected: "triangles from which a tree can be built",
        })?;
        Ok(Self(mesh))
    }

    pub fn cast(&self, origin: &Point3<f64>, direction: &Vector3<f64>) -> Option<Crossing> {
        // parry reports distance zero for a ray that starts on a triangle; starting a little further avoids that.
        let start = origin.coords + direction * NEAREST_M;
        let ray = Ray::new(parry(&start), parry(direction));
        let hit = self.0.cast_local_ray_and_get_normal(&ray, f64::MAX, false)?;
        let normal = Vector3::new(hit.normal.x, hit.normal.y, hit.normal.z).normalize();
        let facing = if normal.dot(direction) > 0.0 { -normal } else { normal };
        Some(Crossing { distance_m: hit.time_of_impact + NEAREST_M, normal: facing, face: 0 })
    }
}
