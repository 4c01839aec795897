//! Triangle meshes as targets: registration of measured points to a known model `[BeslMcKay1992]`.

mod bridge;

use nalgebra::{Point3, Vector3};
use rigid_pose::InputError;

use crate::error::{Error, Result};
use crate::parts::{Partner, PointMatching, Query, TargetSurface};
use rigid_pose::require_points;

/// Triangles with a search tree over them, metre.
pub struct TriangleMesh {
    tree: bridge::Tree,
    normals: Vec<Vector3<f64>>,
    radius_m: f64,
}

impl std::fmt::Debug for TriangleMesh {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "TriangleMesh of {} triangles, radius {} m", self.normals.len(), self.radius_m)
    }
}

impl TriangleMesh {
    /// Builds the tree. `triangles`: indices of three vertices each; triangles without an area are left out.
    ///
    /// # Errors
    /// [`InputError::Empty`] where no triangle with an area is left, [`InputError::NonFinite`] for a vertex,
    /// [`Error::NoSuchVertex`].
    pub fn new(vertices: &[Point3<f64>], triangles: &[[u32; 3]]) -> Result<Self> {
        require_points("vertex of the mesh", vertices)?;
        let count = vertices.len();
        let out_of_range = |triangle: &&[u32; 3]| triangle.iter().any(|&v| v as usize >= count);
        if let Some(triangle) = triangles.iter().find(out_of_range) {
            let vertex = triangle.iter().copied().max().unwrap_or(0) as usize;
            return Err(Error::NoSuchVertex { vertex, count });
        }
        let (mut kept, mut normals, mut areas) = (Vec::new(), Vec::new(), Vec::new());
        for triangle in triangles {
            let [a, b, c] = triangle.map(|v| vertices[v as usize]);
            let (u, v) = (b - a, c - a);
            let cross = u.cross(&v);
            let area = cross.norm();
            // Slivers have no normal beyond rounding.
            if area > 1e-12 * u.norm_squared().max(v.norm_squared()) && area > f64::MIN_POSITIVE {
                kept.push(*triangle);
                normals.push(cross / area);
                areas.push(area);
            }
        }
        if kept.is_empty() {
            return Err(InputError::Empty { what: "the mesh (of triangles with an area)" }.into());
        }
        let radius_m = radius(vertices, &kept, &areas);
        Ok(Self { tree: bridge::Tree::new(vertices, kept)?, normals, radius_m })
    }

    /// Number of triangles with an area.
    pub fn len(&self) -> usize {
        self.normals.len()
    }

    /// Always false: a mesh without triangles cannot be built.
    pub fn is_empty(&self) -> bool {
        self.normals.is_empty()
    }

    /// Root mean square distance of the surface from its centroid, metre.
    pub fn radius_m(&self) -> f64 {
        self.radius_m
    }

    /// The closest point of the surface within `limit_m`, with the unit normal of its triangle (to the side from which
    /// the vertices run counter-clockwise).
    ///
    /// # Errors
    /// [`InputError::NonFinite`] for a query that is not finite.
    pub fn closest(&self, query: &Point3<f64>, limit_m: f64) -> Result<Option<(Point3<f64>, Vector3<f64>)>> {
        require_points("query point", std::slice::from_ref(query))?;
        Ok(self.tree.closest(query, limit_m).map(|(triangle, point)| (point, self.normals[triangle])))
    }
}

/// Root mean square distance from the centroid, each corner with a third of the area of its triangle: corners, unlike middles,
/// tell the size of a mesh of few triangles.
fn radius(vertices: &[Point3<f64>], triangles: &[[u32; 3]], areas: &[f64]) -> f64 {
    let total = 3.0 * areas.iter().sum::<f64>();
    let corners = || triangles.iter().zip(areas).flat_map(|(t, area)| t.map(|v| (vertices[v as usize], area / total)));
    let centre = corners().fold(Point3::origin(), |sum, (corner, share)| sum + corner.coords * share);
    corners().map(|(corner, share)| (corner - centre).norm_squared() * share).sum::<f64>().sqrt()
}

/// The closest point on a triangle mesh, with the normal of its triangle: free of noise, so that it is trusted as exact.
#[derive(Debug, Clone, Copy)]
pub struct ClosestOnMesh<'a> {
    mesh: &'a TriangleMesh,
}

impl<'a> ClosestOnMesh<'a> {
    /// Matches with the surface of `mesh`.
    pub fn new(mesh: &'a TriangleMesh) -> Self {
        Self { mesh }
    }
}

impl PointMatching for ClosestOnMesh<'_> {
    fn target(&self) -> TargetSurface<'_> {
        TargetSurface { cloud: None, radius_m: self.mesh.radius_m, spacing_m: 0.0, exact_normals: true }
    }

    fn partner(&self, query: &Query) -> Partner {
        match self.mesh.tree.closest(&query.moved.into(), query.limit_m) {
            Some((triangle, point)) => {
                let normal = self.mesh.normals[triangle];
                Partner { found: true, target: None, point: point.coords, normal, margin_m: 0.0 }
            }
            None => Partner::none(0.0),
        }
    }
}
