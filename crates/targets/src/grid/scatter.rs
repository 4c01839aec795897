//! How much the nodes of a board scatter beside each other, whatever the perspective, the lens and the bend of the board.

use std::collections::BTreeMap;

use statistics::mad_scale;

use crate::NodePoint;

/// Differences (two for each node with eight neighbours) from which on their scatter is believed: of twelve the scale is
/// known to a third.
const NEEDED: usize = 12;

/// Excess of the scale that chance makes in less than one of a hundred boards, times the root of the number of differences:
/// three deviations of a median deviation, of differences that share nodes. With less, sound boards would be widened.
const CHANCE: f64 = 4.0;

/// A node less half the sum of the four beside it, plus a quarter of the four across: zero for every map that is smooth
/// over three nodes, as it takes off what is linear, and products of what is quadratic.
const MASK: [([isize; 2], f64); 9] = [
    ([0, 0], 1.0),
    ([-1, 0], -0.5),
    ([1, 0], -0.5),
    ([0, -1], -0.5),
    ([0, 1], -0.5),
    ([-1, -1], 0.25),
    ([1, -1], 0.25),
    ([-1, 1], 0.25),
    ([1, 1], 0.25),
];

/// Widens the covariances of a board's nodes where these scatter more than the noise of the image lets them: by the paper,
/// the compression of the image, what lights the board unevenly. Never narrows them.
pub(crate) fn widen(nodes: &mut [NodePoint]) {
    let places: BTreeMap<[usize; 2], usize> =
        nodes.iter().enumerate().map(|(index, seen)| (seen.node, index)).collect();
    let mut differences: Vec<f64> = Vec::new();
    for seen in nodes.iter() {
        for axis in 0..2 {
            differences.extend(standardised(nodes, &places, seen.node, axis).map(f64::abs));
        }
    }
    if differences.len() < NEEDED {
        return;
    }
    let chance = CHANCE / (differences.len() as f64).sqrt();
    let ratio = mad_scale(&mut differences);
    if ratio > 1.0 + chance && ratio.is_finite() {
        for seen in nodes {
            seen.point.covariance *= ratio * ratio;
        }
    }
}

/// The difference at a node over its own deviation; `None` at the rim and beside hidden nodes.
fn standardised(
    nodes: &[NodePoint],
    places: &BTreeMap<[usize; 2], usize>,
    [column, row]: [usize; 2],
    axis: usize,
) -> Option<f64> {
    let (mut difference, mut variance) = (0.0, 0.0);
    for ([right, down], weight) in MASK {
        let node = [column.checked_add_signed(right)?, row.checked_add_signed(down)?];
        let point = &nodes[*places.get(&node)?].point;
        difference += weight * point.pixel[axis];
        variance += weight * weight * point.covariance[(axis, axis)];
    }
    Some(difference / variance.sqrt())
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix2;
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;
    use rand_pcg::Pcg64;

    use super::*;
    use crate::MeasuredPoint;

    /// A tilted board through a lens, scattering by `scatter` and said to do so by 0.05 pixels.
    fn board(scatter: f64, rng: &mut Pcg64) -> Vec<NodePoint> {
        let node = |k: usize| [k % 9, k / 9];
        let seen = |node: [usize; 2], rng: &mut Pcg64| {
            let [x, y] = node.map(|n| n as f64);
            let depth = 1.0 + 0.02 * x - 0.03 * y;
            let place = [12.0 * x / depth, 11.0 * y / depth];
            let bend = 1.0 - 2e-5 * (place[0] - 50.0).hypot(place[1] - 30.0).powi(2);
            let pixel = place.map(|value| 40.0 + bend * value + scatter * rng.sample::<f64, _>(StandardNormal));
            NodePoint { node, point: MeasuredPoint { pixel, covariance: Matrix2::identity() * 0.05_f64.powi(2) } }
        };
        (0..54).map(|k| seen(node(k), rng)).collect()
    }

    fn factor(scatter: f64, rng: &mut Pcg64) -> f64 {
        let mut nodes = board(scatter, rng);
        widen(&mut nodes);
        nodes[0].point.covariance[(0, 0)].sqrt() / 0.05
    }

    #[test]
    fn covariances_follow_the_scatter_and_stay_where_it_is_as_stated() {
        let mut rng = Pcg64::seed_from_u64(9);
        let mut factors = |scatter: f64| (0..400).map(|_| factor(scatter, &mut rng)).collect::<Vec<f64>>();
        let widened = factors(0.05).into_iter().filter(|factor| *factor > 1.0).count();
        assert!(widened <= 6, "{widened} of 400 as stated");
        let threefold = factors(0.15).iter().sum::<f64>() / 400.0;
        assert!((2.7..3.3).contains(&threefold), "{threefold}");
        assert!(factors(0.0).iter().all(|factor| (factor - 1.0).abs() < 1e-12), "a smooth bend is no scatter");
    }

    #[test]
    fn few_nodes_say_nothing() {
        let mut nodes = board(10.0, &mut Pcg64::seed_from_u64(9));
        nodes.truncate(20);
        let before = nodes.clone();
        widen(&mut nodes);
        assert!(nodes == before);
        widen(&mut []);
    }
}
