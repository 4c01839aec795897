use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::check::{coordinates, extent, extents, finite, finite_triple, not_negative, require};
use crate::Result;

/// What stands in front of the camera. World coordinates in metre, z up.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneSpec {
    /// The objects; an object's index here is its number in the truth.
    pub objects: Vec<ObjectSpec>,
}

/// One object: its shape, how much light it sends back, and how that varies over it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObjectSpec {
    /// For people.
    #[serde(default)]
    pub name: String,
    /// Shape and place.
    pub shape: ShapeSpec,
    /// Share of the light sent back, against a white Lambertian surface. Above 1, up to 20: retro-reflective foil,
    /// which sends the camera's own light back to the camera.
    pub albedo: f64,
    /// Variation of the albedo over the surface.
    #[serde(default)]
    pub texture: Option<TextureSpec>,
}

/// Shapes, in world coordinates, metre.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum ShapeSpec {
    /// The inner faces of an axis-parallel box; from outside they are not seen.
    Room {
        /// Lowest corner.
        min_m: [f64; 3],
        /// Highest corner.
        max_m: [f64; 3],
        /// Albedo of the faces at lowest x, highest x, lowest y, highest y, the floor and the ceiling, in place of
        /// the object's one albedo.
        #[serde(default)]
        face_albedo: Option<[f64; 6]>,
    },
    /// A rectangle, seen from both sides: `corner + s edge_u + t edge_v`, s and t in 0..1.
    Rectangle {
        /// One corner.
        corner_m: [f64; 3],
        /// One edge from that corner.
        edge_u_m: [f64; 3],
        /// The other edge from that corner, perpendicular to the first.
        edge_v_m: [f64; 3],
    },
    /// A sphere.
    Sphere {
        /// Centre.
        center_m: [f64; 3],
        /// Radius.
        radius_m: f64,
    },
    /// A box.
    Cuboid {
        /// Centre.
        center_m: [f64; 3],
        /// Full extents along its own axes.
        size_m: [f64; 3],
        /// Turns about the world's x, then y, then z axis.
        #[serde(default)]
        rotation_deg: [f64; 3],
    },
    /// Triangles, seen from both sides.
    Mesh {
        /// Corners.
        vertices_m: Vec<[f64; 3]>,
        /// Three indices of corners each.
        triangles: Vec<[u32; 3]>,
    },
}

/// How the albedo varies over a surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum TextureSpec {
    /// Squares of `size_m`; every other one has `factor` times the albedo. Laid along the two axes of the shape's own
    /// frame that are nearest to the surface.
    Checker {
        /// Side of a square.
        size_m: f64,
        /// Factor on the albedo in every other square.
        factor: f64,
    },
    /// Discs of full albedo at the nodes of a square grid; `factor` times the albedo between them. Laid as a checker is.
    Discs {
        /// Distance of neighbouring centres.
        spacing_m: f64,
        /// Radius of a disc.
        radius_m: f64,
        /// Factor on the albedo between the discs.
        factor: f64,
        /// Centre of one of them, along the two axes.
        #[serde(default)]
        first_m: [f64; 2],
    },
    /// Smooth random variation: the albedo times `1 + contrast * v`, v in -1..1.
    Noise {
        /// Distance over which the variation changes.
        size_m: f64,
        /// Largest relative change, below 1.
        contrast: f64,
        /// Seed of this texture.
        seed: u64,
    },
}

/// Highest albedo that is accepted: a good retro-reflective foil against a white wall.
const HIGHEST_ALBEDO: f64 = 20.0;

impl SceneSpec {
    pub(crate) fn validate(&self) -> Result<()> {
        require(!self.objects.is_empty(), "scene.objects", &self.objects.len(), "at least one object")?;
        for (index, object) in self.objects.iter().enumerate() {
            object.validate(&format!("scene.objects[{index}]"))?;
        }
        Ok(())
    }
}

fn albedo(field: String, value: f64) -> Result<()> {
    let holds = value.is_finite() && value > 0.0 && value <= HIGHEST_ALBEDO;
    require(holds, field, &value, "an albedo above 0 and at most 20")
}

impl ObjectSpec {
    fn validate(&self, path: &str) -> Result<()> {
        albedo(format!("{path}.albedo"), self.albedo)?;
        self.shape.validate(&format!("{path}.shape"))?;
        self.texture.map_or(Ok(()), |texture| texture.validate(&format!("{path}.texture")))
    }
}

impl ShapeSpec {
    fn validate(&self, path: &str) -> Result<()> {
        match self {
            Self::Room { min_m, max_m, face_albedo } => {
                coordinates(format!("{path}.min_m"), min_m)?;
                coordinates(format!("{path}.max_m"), max_m)?;
                let ordered = min_m.iter().zip(max_m).all(|(low, high)| low < high);
                require(ordered, format!("{path}.max_m"), max_m, "above min_m in each coordinate")?;
                for value in face_albedo.iter().flatten() {
                    albedo(format!("{path}.face_albedo"), *value)?;
                }
                Ok(())
            }
            Self::Rectangle { corner_m, edge_u_m, edge_v_m } => {
                coordinates(format!("{path}.corner_m"), corner_m)?;
                validate_edges(path, edge_u_m, edge_v_m)
            }
            Self::Sphere { center_m, radius_m } => {
                coordinates(format!("{path}.center_m"), center_m)?;
                extent(format!("{path}.radius_m"), *radius_m)
            }
            Self::Cuboid { center_m, size_m, rotation_deg } => {
                coordinates(format!("{path}.center_m"), center_m)?;
                extents(format!("{path}.size_m"), size_m)?;
                finite_triple(format!("{path}.rotation_deg"), rotation_deg)
            }
            Self::Mesh { vertices_m, triangles } => validate_mesh(path, vertices_m, triangles),
        }
    }
}

fn validate_edges(path: &str, edge_u_m: &[f64; 3], edge_v_m: &[f64; 3]) -> Result<()> {
    for (name, edge) in [("edge_u_m", edge_u_m), ("edge_v_m", edge_v_m)] {
        coordinates(format!("{path}.{name}"), edge)?;
        extent(format!("{path}.{name}"), Vector3::from(*edge).norm())?;
    }
    let (u, v) = (Vector3::from(*edge_u_m), Vector3::from(*edge_v_m));
    // Edges written with six decimals are perpendicular to about 1e-6.
    let perpendicular = u.dot(&v).abs() <= 1e-5 * u.norm() * v.norm();
    require(perpendicular, format!("{path}.edge_v_m"), edge_v_m, "perpendicular to edge_u_m")
}

fn validate_mesh(path: &str, vertices: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<()> {
    require(!triangles.is_empty(), format!("{path}.triangles"), &0, "at least one triangle")?;
    for (index, vertex) in vertices.iter().enumerate() {
        coordinates(format!("{path}.vertices_m[{index}]"), vertex)?;
    }
    for (index, triangle) in triangles.iter().enumerate() {
        let field = format!("{path}.triangles[{index}]");
        let corner = |i: usize| vertices.get(triangle[i] as usize).copied().map(Vector3::from);
        let (Some(a), Some(b), Some(c)) = (corner(0), corner(1), corner(2)) else {
            return require(false, field, triangle, "indices of vertices_m");
        };
        let area = (b - a).cross(&(c - a)).norm() / 2.0;
        require(area > 1e-12, field, triangle, "corners that span more than 1e-12 square metres")?;
    }
    Ok(())
}

impl TextureSpec {
    fn validate(&self, path: &str) -> Result<()> {
        match *self {
            Self::Checker { size_m, factor } => {
                extent(format!("{path}.size_m"), size_m)?;
                not_negative(format!("{path}.factor"), factor)
            }
            Self::Discs { spacing_m, radius_m, factor, first_m } => {
                for value in first_m {
                    finite(format!("{path}.first_m"), value)?;
                }
                extent(format!("{path}.spacing_m"), spacing_m)?;
                extent(format!("{path}.radius_m"), radius_m)?;
                not_negative(format!("{path}.factor"), factor)
            }
            Self::Noise { size_m, contrast, .. } => {
                extent(format!("{path}.size_m"), size_m)?;
                finite(format!("{path}.contrast"), contrast)?;
                let holds = (0.0..1.0).contains(&contrast);
                require(holds, format!("{path}.contrast"), &contrast, "a contrast from 0 to below 1")
            }
        }
    }
}
