//! Which dots of a lattice are larger than those about them.

use std::collections::BTreeMap;

use statistics::upper_median;

use crate::circles::find::CircleSighting;
use crate::grid::lattice::{Lattice, Node};

/// Whether each dot is the larger one: by more than the root of `ratio` against the median of those within two nodes.
pub(crate) fn are_larger(lattice: &Lattice, sightings: &[CircleSighting], ratio: f64) -> BTreeMap<Node, bool> {
    let radius = |index: usize| sightings[index].ellipse.mean_radius_px();
    let is_larger = |node: &Node, index: usize| {
        let near = |other: &Node| *other != *node && (0..2).all(|axis| (other[axis] - node[axis]).abs() <= 2);
        let about = lattice.nodes.iter().filter(|(other, _)| near(other));
        let mut radii: Vec<f64> = about.map(|(_, &index)| radius(index)).collect();
        radius(index) > ratio.sqrt() * upper_median(&mut radii)
    };
    lattice.nodes.iter().map(|(node, &index)| (*node, is_larger(node, index))).collect()
}
