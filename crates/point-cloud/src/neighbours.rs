//! Nearest neighbours: the one place that speaks to the k-d tree.
//!
//! The tree answers an empty set or a NaN query with item 0 at infinity, takes squared radii, and breaks ties by its
//! own layout. This wrapper refuses the first, hides the second and gives ties to the lowest index. Points that coincide
//! are one item of the tree, which cannot divide them and would look at all of them in each answer.

use std::num::NonZeroUsize;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nalgebra::Point3;
use rigid_pose::{InputError, require_points};

use crate::coincident::Places;
use crate::error::{Error, Result};

const TWO: NonZeroUsize = NonZeroUsize::MIN.saturating_add(1);

/// One answer: a point of the tree and how far it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Neighbour {
    /// Index into the points that the tree was built from.
    pub index: usize,
    /// Euclidean distance, metre.
    pub distance_m: f64,
}

/// A k-d tree over points in space, built once and asked often.
#[derive(Debug)]
pub struct NeighbourTree {
    tree: ImmutableKdTree<f64, 3>,
    len: usize,
    places: Places,
}

impl NeighbourTree {
    /// Builds the tree over `points` (metre).
    ///
    /// # Errors
    /// [`InputError::Empty`] without points, [`InputError::NonFinite`] naming the first point that is not finite.
    pub fn new(points: &[Point3<f64>]) -> Result<Self> {
        if points.is_empty() {
            return Err(InputError::Empty { what: "the point set of the search tree" }.into());
        }
        require_points("point of the search tree", points)?;
        let places = Places::new(points);
        let coordinates: Vec<[f64; 3]> = places.firsts().map(|k| points[k].coords.into()).collect();
        let tree = ImmutableKdTree::new_from_slice(&coordinates).map_err(|e| Error::Tree(e.to_string()))?;
        Ok(Self { tree, len: points.len(), places })
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Always false: an empty tree cannot be built.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The nearest point; of several at the same distance the one with the lowest index.
    ///
    /// # Errors
    /// [`InputError::NonFinite`] for a query that is not finite.
    pub fn nearest(&self, query: &Point3<f64>) -> Result<Neighbour> {
        let query = checked(query)?;
        let best = self.tree.query(&query).nearest_one::<SquaredEuclidean<f64>>().execute();
        // A second, tiny query: whatever lies on the sphere through the best point.
        let mut index = self.places.first(best.item);
        let on_sphere = self.tree.query(&query).within::<SquaredEuclidean<f64>>(best.distance).unsorted();
        on_sphere.visit(|item| index = index.min(self.places.first(item.item)));
        Ok(neighbour(index, best.distance))
    }

    /// The `count` nearest points in the order of distance, then index (fewer where the tree holds fewer).
    ///
    /// # Errors
    /// [`InputError::NonFinite`] for a query that is not finite.
    pub fn k_nearest(&self, query: &Point3<f64>, count: usize) -> Result<Vec<Neighbour>> {
        let query = checked(query)?;
        let Some(count) = NonZeroUsize::new(count.min(self.len)) else { return Ok(Vec::new()) };
        let mut found: Vec<Neighbour> = self
            .tree
            .query(&query)
            .nearest_n::<SquaredEuclidean<f64>>(count)
            .execute()
            .iter()
            .flat_map(|item| self.places.points(item.item).take(count.get()).map(|k| neighbour(k, item.distance)))
            .collect();
        found.sort_by(|a, b| a.distance_m.total_cmp(&b.distance_m).then(a.index.cmp(&b.index)));
        found.truncate(count.get());
        Ok(found)
    }

    /// A nearest point of a query that is known to be finite: of several at the same distance always the same one, as
    /// the tree's layout has it. For hot loops, where looking for the lowest index would double the time.
    #[must_use]
    pub fn any_nearest(&self, query: &[f64; 3]) -> Neighbour {
        let best = self.tree.query(query).nearest_one::<SquaredEuclidean<f64>>().execute();
        neighbour(self.places.first(best.item), best.distance)
    }

    /// A nearest point within `reach_m` of a query that is known to be finite, and the distance of the nearest elsewhere (or
    /// the reach, where there is none within it).
    #[must_use]
    pub fn two_nearest(&self, query: &Point3<f64>, reach_m: f64) -> Option<(Neighbour, f64)> {
        let query = [query.x, query.y, query.z];
        let found = self
            .tree
            .query(&query)
            .nearest_n::<SquaredEuclidean<f64>>(TWO)
            .within::<SquaredEuclidean<f64>>(reach_m * reach_m)
            .execute();
        let nearest = found.first()?;
        let second_m = found.get(1).map_or(reach_m, |item| item.distance.sqrt());
        Some((neighbour(self.places.first(nearest.item), nearest.distance), second_m))
    }
}

fn neighbour(index: usize, square: f64) -> Neighbour {
    Neighbour { index, distance_m: square.sqrt() }
}

fn checked(query: &Point3<f64>) -> Result<[f64; 3]> {
    require_points("query point", std::slice::from_ref(query))?;
    Ok([query.x, query.y, query.z])
}
