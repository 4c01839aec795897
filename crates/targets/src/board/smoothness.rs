//! Corners that leave the smooth map of the board onto the image.

use std::collections::BTreeMap;

use nalgebra::{Matrix6, Matrix6x2, Vector2, Vector6};
use statistics::{CHI_MEDIANS, Distribution, bonferroni, upper_median};

use super::corners::refine::Corner;
use crate::grid::lattice::{Lattice, Node};

/// Nodes about a node that predict it, columns and rows: the lens is a parabola over them.
const ABOUT: i32 = 3;

/// Nodes about a node that a parabola is fitted to at least, twice its six terms.
const PARABOLA: usize = 12;

/// Probability that a board loses a good node.
const LEVEL: f64 = 1e-3;

/// Least deviation from the smooth map that counts, pixel: a homography and a parabola leave that much of a lens.
const LEAST_PX: f64 = 0.03;

/// Leaves out corners that differ from what those about them say by more than chance, the worst first; and the robust
/// standard deviation of the rest from that, pixel, both coordinates together. NaN where no corner has eight about it.
pub(crate) fn without_strays(mut corners: Vec<Corner>) -> (Vec<Corner>, f64) {
    loop {
        let deviations = deviations(&corners);
        let mut known: Vec<f64> = deviations.iter().flatten().copied().collect();
        let scale = upper_median(&mut known) / CHI_MEDIANS[1];
        let level = bonferroni(LEVEL, corners.len());
        let limit = scale.max(LEAST_PX) * (Distribution::ChiSquared { dof: 2.0 }).critical(level).sqrt();
        let worst =
            (0..corners.len()).max_by(|&a, &b| deviations[a].unwrap_or(0.0).total_cmp(&deviations[b].unwrap_or(0.0)));
        match worst.filter(|&worst| deviations[worst].is_some_and(|deviation| deviation > limit)) {
            Some(worst) => drop(corners.remove(worst)),
            None => return (corners, scale * std::f64::consts::SQRT_2),
        }
    }
}

/// Distance of each corner from where those about it have it, pixel.
fn deviations(corners: &[Corner]) -> Vec<Option<f64>> {
    let points: Vec<Vector2<f64>> = corners.iter().map(|corner| corner.position).collect();
    let nodes: BTreeMap<_, _> = corners.iter().enumerate().map(|(k, corner)| (corner.node, k)).collect();
    let lattice = Lattice { nodes };
    let deviation = |corner: &Corner| Some((predict(&lattice, &points, corner.node)? - corner.position).norm());
    corners.iter().map(deviation).collect()
}

/// Where the nodes about a node have it: by their homography, and a parabola of what it leaves.
fn predict(lattice: &Lattice, points: &[Vector2<f64>], node: Node) -> Option<Vector2<f64>> {
    let map = lattice.map_about(points, node, ABOUT)?;
    let place = map.map(Vector2::zeros())?;
    let (mut normal, mut right) = (Matrix6::zeros(), Matrix6x2::zeros());
    let mut count = 0;
    for (other, &k) in lattice.nodes.range([node[0] - ABOUT, i32::MIN]..=[node[0] + ABOUT, i32::MAX]) {
        let offset = Vector2::new(f64::from(other[0] - node[0]), f64::from(other[1] - node[1]));
        if *other != node && offset.amax() <= f64::from(ABOUT) {
            let [x, y] = offset.into();
            let terms = Vector6::new(1.0, x, y, x * x, x * y, y * y);
            normal += terms * terms.transpose();
            right += terms * (points[k] - map.map(offset)?).transpose();
            count += 1;
        }
    }
    let parabola = if count < PARABOLA { None } else { normal.cholesky() };
    // Its constant is its value at the node; fewer than three columns or rows have none.
    Some(parabola.map_or(place, |parabola| place + parabola.solve(&right).row(0).transpose()))
}
