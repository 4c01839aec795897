//! The bridge to parry, whose own vectors (glam) do not leave this module.

use nalgebra::Point3;
use parry3d_f64::math::Vector as ParryVector;
use parry3d_f64::query::PointQueryWithLocation;
use parry3d_f64::shape::TriMesh;

use crate::error::{Error, Result};

/// parry's tree over triangles.
pub(super) struct Tree(TriMesh);

fn to_parry(p: &Point3<f64>) -> ParryVector {
    ParryVector::new(p.x, p.y, p.z)
}

impl Tree {
    /// Vertices must be finite, indices in range.
    pub fn new(vertices: &[Point3<f64>], triangles: Vec<[u32; 3]>) -> Result<Self> {
        let mesh = TriMesh::new(vertices.iter().map(to_parry).collect(), triangles);
        mesh.map(Self).map_err(|error| Error::Cloud(point_cloud::Error::Tree(error.to_string())))
    }

    /// Index of the closest triangle and the point on it, if there is one within the limit. The query must be finite.
    pub fn closest(&self, query: &Point3<f64>, limit_m: f64) -> Option<(usize, Point3<f64>)> {
        let found = self.0.project_local_point_and_get_location_with_max_dist(to_parry(query), false, limit_m)?;
        let (projection, (triangle, _)) = found;
        Some((triangle as usize, Point3::new(projection.point.x, projection.point.y, projection.point.z)))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use nalgebra::Vector3;
    use proptest::prelude::*;

    /// Closest point of a triangle by the regions of its corners and edges, after `[Ericson2005]`.
    fn closest_on_triangle(p: &Point3<f64>, [a, b, c]: [Point3<f64>; 3]) -> Point3<f64> {
        let on_edge = |a: Point3<f64>, b: Point3<f64>| {
            let d: Vector3<f64> = b - a;
            a + d * ((p - a).dot(&d) / d.norm_squared()).clamp(0.0, 1.0)
        };
        let normal = (b - a).cross(&(c - a));
        let foot = p - normal * ((p - a).dot(&normal) / normal.norm_squared());
        let inside = [(a, b), (b, c), (c, a)].iter().all(|(u, v)| (v - u).cross(&(foot - u)).dot(&normal) >= 0.0);
        let mut best = if inside { foot } else { on_edge(a, b) };
        for candidate in [on_edge(b, c), on_edge(c, a)] {
            if !inside && (candidate - p).norm() < (best - p).norm() {
                best = candidate;
            }
        }
        best
    }

    fn point(v: [f64; 3]) -> Point3<f64> {
        Point3::from(v)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]
        #[test]
        fn the_tree_agrees_with_a_search_through_all_triangles(
            corners in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 9..30),
            query in prop::array::uniform3(-2.0..2.0_f64), shift in -1e4..1e4_f64,
        ) {
            let vertices: Vec<_> = corners.iter().map(|c| point(*c) + Vector3::repeat(shift)).collect();
            let triangles: Vec<[u32; 3]> = (0..vertices.len() as u32 - 2).map(|i| [i, i + 1, i + 2]).collect();
            let query = point(query) + Vector3::repeat(shift);
            let tree = Tree::new(&vertices, triangles.clone()).unwrap();
            let (triangle, found) = tree.closest(&query, f64::MAX).unwrap();
            let all = triangles.iter().map(|t| closest_on_triangle(&query, t.map(|v| vertices[v as usize])));
            let distances: Vec<f64> = all.map(|p| (p - query).norm()).collect();
            let least = distances.iter().copied().fold(f64::INFINITY, f64::min);
            // f64 throughout: at 10 km from the origin a coordinate is known to 2e-12 m, in f32 it would be a millimetre.
            prop_assert!(((found - query).norm() - least).abs() < 1e-9);
            prop_assert!((distances[triangle] - least).abs() < 1e-9);
            prop_assert!(tree.closest(&query, 0.5 * least).is_none() || least < 1e-12);
        }
    }
}
