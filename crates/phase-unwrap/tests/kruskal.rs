//! The tree against Kruskal's algorithm: all edges sorted by cost, ties by position, joined by union-find.

use std::f32::consts::{PI, TAU};

use phase_unwrap::{Boundary, SpatialOptions, unwrap_spatial};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use range_image::Raster;

const OPEN: [Boundary; 2] = [Boundary::Open; 2];

/// Second-difference cost written out plainly; NaN is masked.
fn plain_cost(phase: &Raster<f32>, boundaries: [Boundary; 2]) -> Vec<f32> {
    let wrapped = |d: f32| d - if d > PI { TAU } else { 0.0 } + if d < -PI { TAU } else { 0.0 };
    let at = |col: i64, row: i64| {
        let around = |at: i64, size: usize, boundary| {
            if boundary == Boundary::Cyclic { at.rem_euclid(size as i64) } else { at }
        };
        let (col, row) = (around(col, phase.width(), boundaries[0]), around(row, phase.height(), boundaries[1]));
        let inside = col >= 0 && row >= 0;
        let value = inside.then(|| phase.get(col as usize, row as usize).copied()).flatten();
        value.filter(|value| !value.is_nan())
    };
    let mut costs = Vec::new();
    for row in 0..phase.height() as i64 {
        for col in 0..phase.width() as i64 {
            let centre = phase[(col as usize, row as usize)];
            let (mut sum, mut count) = (0.0, 0.0);
            for (dc, dr) in [(-1, 0), (0, -1), (-1, -1), (1, -1)] {
                if let (Some(one), Some(other)) = (at(col + dc, row + dr), at(col - dc, row - dr)) {
                    sum += (wrapped(one - centre) + wrapped(other - centre)).powi(2);
                    count += 1.0;
                }
            }
            costs.push(if count > 0.0 { sum * (4.0 / count) } else { 256.0 });
        }
    }
    costs
}

/// Edges in the order of the tie rule: scan order of the first pixel, to the right before down, then the seams.
fn edges(phase: &Raster<f32>, cost: &[f32], boundaries: [Boundary; 2]) -> Vec<(f32, usize, usize)> {
    let (width, height) = (phase.width(), phase.height());
    let mut pairs = Vec::new();
    for pixel in 0..width * height {
        let right = (pixel % width + 1 < width).then_some(pixel + 1);
        let down = (pixel / width + 1 < height).then_some(pixel + width);
        pairs.extend(right.into_iter().chain(down).map(|other| (pixel, other)));
    }
    if boundaries[0] == Boundary::Cyclic {
        pairs.extend((0..height).map(|row| ((row + 1) * width - 1, row * width)));
    }
    if boundaries[1] == Boundary::Cyclic {
        pairs.extend((0..width).map(|col| ((height - 1) * width + col, col)));
    }
    let used = |pixel: usize| !phase.as_slice()[pixel].is_nan();
    let used = pairs.into_iter().filter(|&(a, b)| used(a) && used(b));
    used.map(|(a, b)| (cost[a] + cost[b], a, b)).collect()
}

/// Root of a pixel and its wrap count relative to the root.
fn root(parent: &[(usize, i32)], mut pixel: usize) -> (usize, i32) {
    let mut wraps = 0;
    while parent[pixel].0 != pixel {
        wraps += parent[pixel].1;
        pixel = parent[pixel].0;
    }
    (pixel, wraps)
}

/// Wrap counts, the lowest of each tree 0, and number of trees. Masked pixels get 0.
fn kruskal(phase: &Raster<f32>, boundaries: [Boundary; 2]) -> (Vec<i32>, usize) {
    let mut edges = edges(phase, &plain_cost(phase, boundaries), boundaries);
    // A stable sort keeps the order of equals.
    edges.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut parent: Vec<(usize, i32)> = (0..phase.len()).map(|pixel| (pixel, 0)).collect();
    let mut size = vec![1; phase.len()];
    for (_, a, b) in edges {
        let ((root_a, wraps_a), (root_b, wraps_b)) = (root(&parent, a), root(&parent, b));
        if root_a == root_b {
            continue;
        }
        let difference = phase.as_slice()[a] - phase.as_slice()[b];
        let step = i32::from(difference > PI) - i32::from(difference < -PI);
        // Count of root b minus that of root a.
        let shift = wraps_a + step - wraps_b;
        let (kept, hung, offset) =
            if size[root_a] >= size[root_b] { (root_a, root_b, shift) } else { (root_b, root_a, -shift) };
        parent[hung] = (kept, offset);
        size[kept] += size[hung];
    }
    let places: Vec<(usize, i32)> = (0..phase.len()).map(|pixel| root(&parent, pixel)).collect();
    let mut lowest = vec![i32::MAX; phase.len()];
    for &(root, wraps) in &places {
        lowest[root] = lowest[root].min(wraps);
    }
    let used = |pixel: usize| !phase.as_slice()[pixel].is_nan();
    let trees = (0..phase.len()).filter(|&pixel| used(pixel) && places[pixel].0 == pixel).count();
    (places.iter().map(|&(root, wraps)| wraps - lowest[root]).collect(), trees)
}

/// A slope with noise, wrapped, some pixels masked as NaN, phases rounded to a grid where `quantum` is not zero.
fn scene(size: (usize, usize), seed: u64, noise: f32, masked: f32, quantum: f32) -> Raster<f32> {
    let mut rng = Pcg64::seed_from_u64(seed);
    Raster::from_fn(size.0, size.1, |col, row| {
        let (x, y) = (col as f32, row as f32);
        let surface = 0.8 * x - 0.5 * y + 3.0 * (0.2 * x).sin() + noise * (rng.random::<f32>() - 0.5);
        let surface = if quantum > 0.0 { (surface / quantum).round() * quantum } else { surface };
        if rng.random::<f32>() < masked { f32::NAN } else { surface.rem_euclid(TAU).min(TAU) }
    })
}

fn compare(phase: &Raster<f32>, boundaries: [Boundary; 2]) {
    let (wraps, trees) = kruskal(phase, boundaries);
    let options = SpatialOptions { boundaries, ..SpatialOptions::default() };
    let found = unwrap_spatial(phase, None, None, &options).unwrap();
    assert_eq!(found.wraps.as_slice(), wraps);
    assert_eq!(found.islands.len(), trees);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_contraction_is_the_minimum_spanning_tree(
        seed in 0_u64..1000,
        // From smooth to nothing but noise.
        noise in prop_oneof![Just(0.0_f32), 0.01_f32..2.0, Just(12.0)],
        masked in prop_oneof![Just(0.0_f32), 0.01_f32..0.6],
        // Coarse phases have many equal costs: only the stated rule for ties gives the same counts.
        quantum in prop_oneof![Just(0.0_f32), Just(PI / 4.0), Just(0.5)],
        width in 1_usize..40,
        height in 1_usize..40,
        boundaries in prop_oneof![
            Just(OPEN),
            Just([Boundary::Cyclic, Boundary::Open]),
            Just([Boundary::Open, Boundary::Cyclic]),
            Just([Boundary::Cyclic; 2]),
        ],
    ) {
        let phase = scene((width, height), seed, noise, masked, quantum);
        prop_assume!(phase.as_slice().iter().any(|value| !value.is_nan()));
        compare(&phase, boundaries);
    }
}

#[test]
fn large_images_of_odd_sizes_agree_too() {
    for (size, noise, masked) in [((211, 197), 4.0, 0.0), ((389, 101), 7.0, 0.1), ((97, 383), 0.3, 0.3)] {
        compare(&scene(size, 5, noise, masked, 0.0), OPEN);
    }
}
