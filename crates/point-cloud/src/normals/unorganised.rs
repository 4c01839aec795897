//! Normals of an unorganised cloud from its nearest neighbours.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use rigid_pose::require_count;

use super::{Neighbourhood, facing, no_normal};
use crate::error::Result;
use crate::neighbours::NeighbourTree;

/// How many neighbours a normal is taken from, and which side it points to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnorganisedNormalOptions {
    /// Nearest points (with the point itself) that the plane is fitted to. Default 20.
    pub neighbours: usize,
    /// Neighbours beyond this distance are left out, metre. Default: no limit.
    pub max_distance_m: Option<f64>,
    /// The normals are turned towards this point. Default: none, the sign is then arbitrary.
    pub viewpoint: Option<Point3<f64>>,
}

impl Default for UnorganisedNormalOptions {
    fn default() -> Self {
        Self { neighbours: 20, max_distance_m: None, viewpoint: None }
    }
}

/// Unit normals of a cloud; NaN in all components where the neighbours form a line or a blob.
///
/// # Errors
/// [`InputError::Empty`](rigid_pose::InputError::Empty), [`InputError::NonFinite`](rigid_pose::InputError::NonFinite), [`InputError::InvalidOption`](rigid_pose::InputError::InvalidOption) for fewer than 3 neighbours.
pub fn unorganised_normals(points: &[Point3<f64>], options: &UnorganisedNormalOptions) -> Result<Vec<Vector3<f64>>> {
    let tree = NeighbourTree::new(points)?;
    normals_with_tree(points, &tree, options)
}

/// As [`unorganised_normals`], on a tree of the same points that is already there.
///
/// # Errors
/// As [`unorganised_normals`].
pub fn normals_with_tree(
    points: &[Point3<f64>],
    tree: &NeighbourTree,
    options: &UnorganisedNormalOptions,
) -> Result<Vec<Vector3<f64>>> {
    require_count("neighbours", options.neighbours, 3)?;
    points
        .par_iter()
        .with_min_len(256)
        .map(|point| {
            let limit = options.max_distance_m.unwrap_or(f64::INFINITY);
            let mut neighbourhood = Neighbourhood::default();
            for neighbour in tree.k_nearest(point, options.neighbours)? {
                if neighbour.distance_m <= limit {
                    neighbourhood.add(&(points[neighbour.index] - point));
                }
            }
            Ok(match (neighbourhood.normal(3), options.viewpoint) {
                (None, _) => no_normal(),
                (Some(normal), None) => normal,
                (Some(normal), Some(viewpoint)) => facing(normal, &(viewpoint - point)),
            })
        })
        .collect()
}
