//! The cheapest cuts, against exhaustive search and an independent proof of the optimum.

use std::f32::consts::{PI, TAU};

use phase_unwrap::{CutPrice, Error, ExactOptions, ExactUnwrapped, LeastCuts, unwrap_least_cuts};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::Raster;

const UNIFORM: ExactOptions = ExactOptions { price: CutPrice::Uniform, maximum_residues: 100_000 };

/// Cycles of the smaller step, by rounding rather than by comparison.
fn smaller_step(from: f32, to: f32) -> i64 {
    ((f64::from(from) - f64::from(to)) / std::f64::consts::TAU).round() as i64
}

/// Steps between used neighbours: pixels, price, cycles of the smaller step.
fn steps(phase: &Raster<f32>, weights: Option<&Raster<f32>>) -> Vec<([usize; 2], i64, i64)> {
    let (width, height) = (phase.width(), phase.height());
    let mut all: Vec<f32> = weights.map_or(vec![], |w| w.as_slice().iter().copied().filter(|w| *w > 0.0).collect());
    all.sort_by(f32::total_cmp);
    // The full price belongs to the 95 % quantile of the weights.
    let full = all.get((all.len() as f32 * 0.95) as usize).copied().unwrap_or(1.0);
    let price = |a: usize, b: usize| {
        let quality = |at: usize| weights.map_or(1.0, |w| (w.as_slice()[at].max(0.0) / full).min(1.0));
        1 + (99.0 * quality(a).min(quality(b))).round() as i64
    };
    let mut found = Vec::new();
    for row in 0..height {
        for col in 0..width {
            let at = row * width + col;
            for (inside, other) in [(col + 1 < width, at + 1), (row + 1 < height, at + width)] {
                if inside && phase.as_slice()[at].is_finite() && phase.as_slice()[other].is_finite() {
                    let cycles = smaller_step(phase.as_slice()[at], phase.as_slice()[other]);
                    found.push(([at, other], price(at, other), cycles));
                }
            }
        }
    }
    found
}

fn cost(steps: &[([usize; 2], i64, i64)], wraps: &[i32]) -> u64 {
    let prices = steps.iter().map(|([a, b], price, cycles)| price * (i64::from(wraps[*b] - wraps[*a]) - cycles).abs());
    prices.sum::<i64>() as u64
}

fn root(parent: &mut [usize], mut at: usize) -> usize {
    while parent[at] != at {
        at = parent[at];
    }
    at
}

/// No cycle of the residual dual network has a negative cost: the proof that no flow is cheaper `[Klein1967]`.
fn is_optimal(phase: &Raster<f32>, weights: Option<&Raster<f32>>, wraps: &Raster<i32>) -> bool {
    let (width, height) = (phase.width(), phase.height());
    // Loops (col, row) with corner pixels (col - 1 .. col, row - 1 .. row); those at masked steps are joined.
    let columns = width + 1;
    let mut parent: Vec<usize> = (0..columns * (height + 1)).collect();
    let used = |col: i64, row: i64| {
        let inside = (0..width as i64).contains(&col) && (0..height as i64).contains(&row);
        inside && phase[(col as usize, row as usize)].is_finite()
    };
    for row in 0..=height {
        for col in 0..=width {
            let (c, r) = (col as i64, row as i64);
            // Across the step between the pixels above right and below right of the loop's centre, and below.
            for (inside, open, other) in [
                (col < width, used(c, r - 1) && used(c, r), row * columns + col + 1),
                (row < height, used(c - 1, r) && used(c, r), (row + 1) * columns + col),
            ] {
                if inside && !open {
                    let (a, b) = (root(&mut parent, row * columns + col), root(&mut parent, other));
                    parent[a.max(b)] = a.min(b);
                }
            }
        }
    }
    let mut arcs = Vec::new();
    for ([a, b], price, cycles) in steps(phase, weights) {
        let added = i64::from(wraps.as_slice()[b] - wraps.as_slice()[a]) - cycles;
        let (col, row) = (a % width, a / width);
        // A step to the right lies between the loops above and below, a step down between those left and right.
        let loops = if b == a + 1 {
            [row * columns + col + 1, (row + 1) * columns + col + 1]
        } else {
            [(row + 1) * columns + col + 1, (row + 1) * columns + col]
        };
        let [one, other] = loops.map(|at| root(&mut parent, at));
        arcs.push((one, other, if added >= 0 { price } else { -price }));
        arcs.push((other, one, if added <= 0 { price } else { -price }));
    }
    let mut distance = vec![0_i64; parent.len()];
    for _ in 0..=parent.len() {
        let mut changed = false;
        for &(from, to, cost) in &arcs {
            if distance[from] + cost < distance[to] {
                distance[to] = distance[from] + cost;
                changed = true;
            }
        }
        if !changed {
            return true;
        }
    }
    false
}

fn random(width: usize, height: usize, masked: f64, rng: &mut Pcg64) -> Raster<f32> {
    Raster::from_fn(width, height, |_, _| {
        if rng.random::<f64>() < masked { f32::NAN } else { rng.random::<f32>() * (TAU - 1e-3) }
    })
}

fn check(phase: &Raster<f32>, weights: Option<&Raster<f32>>, found: &ExactUnwrapped) {
    let steps = steps(phase, weights);
    assert_eq!(found.cost, cost(&steps, found.wraps.as_slice()), "the stated cost is that of the counts");
    assert_eq!(found.cost, found.lower_bound);
    assert!(is_optimal(phase, weights, &found.wraps), "a cheaper flow exists");
}

#[test]
fn three_by_three_equals_exhaustive_search() {
    let mut rng = Pcg64::seed_from_u64(1);
    for case in 0..12 {
        let phase = random(3, 3, 0.0, &mut rng);
        let weights = (case % 2 == 1).then(|| Raster::from_fn(3, 3, |_, _| rng.random::<f32>()));
        let found = unwrap_least_cuts(&phase, weights.as_ref(), None, &UNIFORM).unwrap();
        check(&phase, weights.as_ref(), &found);
        let steps = steps(&phase, weights.as_ref());
        // All counts from -2 to 2 against the first pixel.
        let best = (0..5_u32.pow(8)).map(|code| {
            let mut wraps = [0; 9];
            for (pixel, wraps) in wraps.iter_mut().enumerate().skip(1) {
                *wraps = (code / 5_u32.pow(pixel as u32 - 1) % 5) as i32 - 2;
            }
            cost(&steps, &wraps)
        });
        assert_eq!(Some(found.cost), best.min(), "case {case}: {phase:?}");
    }
}

#[test]
fn random_images_with_masks_and_weights_are_proven() {
    let mut rng = Pcg64::seed_from_u64(2);
    let mut residues = 0;
    for case in 0..60 {
        let size = [1 + case % 13, 2 + case % 11];
        let phase = random(size[0], size[1], [0.0, 0.05, 0.3][case % 3], &mut rng);
        if phase.as_slice().iter().all(|phase| phase.is_nan()) {
            continue;
        }
        let weights = (case % 2 == 1).then(|| Raster::from_fn(size[0], size[1], |_, _| rng.random::<f32>().powi(3)));
        let found = unwrap_least_cuts(&phase, weights.as_ref(), None, &UNIFORM).unwrap();
        check(&phase, weights.as_ref(), &found);
        residues += found.residues;
    }
    assert!(residues > 300, "{residues}");
}

#[test]
fn a_hole_closes_as_a_whole() {
    // A vortex around a hole of 4 x 4 pixels, and one of the other sense far away: the cut joins both.
    let vortex = |col: usize, row: usize, c: f32, r: f32| (row as f32 - r).atan2(col as f32 - c);
    let phase = Raster::from_fn(40, 24, |col, row| {
        let hole = (8..12).contains(&col) && (10..14).contains(&row);
        let angle = vortex(col, row, 9.5, 11.5) - vortex(col, row, 26.5, 11.5);
        if hole { f32::NAN } else { angle.rem_euclid(TAU).min(TAU) }
    });
    let found = unwrap_least_cuts(&phase, None, None, &UNIFORM).unwrap();
    check(&phase, None, &found);
    // From the hole's right side (column 11.5) to the other vortex (26.5): 15 steps at the full price; the way out to
    // the border from there and from the hole is 11.5 + 8 steps long.
    assert_eq!(found.cost, 15 * 100);
}

#[test]
fn smooth_scenes_and_prices_by_smoothness() {
    let mut rng = Pcg64::seed_from_u64(3);
    let slope = Raster::from_fn(53, 41, |col, row| (0.9 * col as f32 + 0.4 * row as f32).rem_euclid(TAU).min(TAU));
    let found = unwrap_least_cuts(&slope, None, None, &ExactOptions::default()).unwrap();
    assert_eq!((found.residues, found.cost, found.islands), (0, 0, 1));
    for (col, row) in (0..41).flat_map(|row| (0..53).map(move |col| (col, row))) {
        let unwrapped = slope[(col, row)] + TAU * found.wraps[(col, row)] as f32;
        assert!((unwrapped - 0.9 * col as f32 - 0.4 * row as f32).abs() < 1e-4);
    }
    // With noise of 0.8 rad: certificate and right counts; at the price by smoothness the cuts fall where noise is.
    let truth = Raster::from_fn(97, 61, |col, row| {
        let noise: f64 = StandardNormal.sample(&mut rng);
        9.0 + 0.15 * col as f64 + 0.05 * row as f64 + 0.8 * noise
    });
    let phase = truth.map(|value| (value.rem_euclid(std::f64::consts::TAU) as f32).min(TAU));
    let wraps = truth.map(|value| value.div_euclid(std::f64::consts::TAU) as i32);
    for price in [CutPrice::Uniform, CutPrice::Smoothness] {
        let found = unwrap_least_cuts(&phase, None, None, &ExactOptions { price, ..UNIFORM }).unwrap();
        let offset = found.wraps[(48, 30)] - wraps[(48, 30)];
        let right = found.wraps.as_slice().iter().zip(wraps.as_slice()).filter(|(a, b)| *a - *b == offset).count();
        println!("{price:?}: {} residues, cost {}, right {right} of 5917", found.residues, found.cost);
        assert!(right > 5800, "{price:?}: {right}");
        assert_eq!(found.cost, found.lower_bound);
    }
}

#[test]
fn hard_cases_have_answers() {
    let run = |phase: &Raster<f32>| unwrap_least_cuts(phase, None, None, &UNIFORM);
    assert!(matches!(run(&Raster::filled(0, 4, 0.0)), Err(Error::Empty { .. })));
    assert!(matches!(run(&Raster::filled(5, 4, f32::NAN)), Err(Error::AllMasked { pixels: 20 })));
    let small = Raster::filled(4, 5, 1.0);
    assert!(matches!(
        unwrap_least_cuts(&Raster::filled(5, 4, 1.0), Some(&small), None, &UNIFORM),
        Err(Error::Raster(_))
    ));
    for (width, height) in [(1, 1), (1, 41), (41, 1), (2, 2), (31, 2)] {
        let phase = Raster::from_fn(width, height, |col, row| (1.7 * (col + row) as f32).rem_euclid(TAU).min(TAU));
        let found = run(&phase).unwrap();
        assert_eq!((found.residues, found.cost, found.islands), (0, 0, 1));
        assert_eq!(found.wraps[(0, 0)], 0);
        let last = phase[(width - 1, height - 1)] + TAU * found.wraps[(width - 1, height - 1)] as f32;
        assert!((last - 1.7 * (width + height - 2) as f32).abs() < 1e-4);
    }
    // Useless weights, and steps of exactly half a cycle.
    let weights = Raster::from_fn(6, 5, |col, _| [f32::NAN, f32::INFINITY, -1.0, 0.0][col % 4]);
    let ties = Raster::from_fn(6, 5, |col, row| if (col + row) % 2 == 0 { 0.0 } else { PI });
    let found = unwrap_least_cuts(&ties, Some(&weights), None, &UNIFORM).unwrap();
    assert_eq!((found.residues, found.cost), (0, 0));
}

/// A vortex in each second loop, in alternating sense.
fn vortices(width: usize, height: usize) -> Raster<f32> {
    let table = [[0.0, 1.6, 3.2, 4.8], [4.8, 3.2, 1.6, 0.0]];
    Raster::from_fn(width, height, |col, row| table[row % 2][col % 4])
}

#[test]
fn dense_residues_are_solved_or_refused() {
    let phase = vortices(37, 29);
    let found = unwrap_least_cuts(&phase, None, None, &UNIFORM).unwrap();
    println!("{} residues, cost {}", found.residues, found.cost);
    assert!(found.residues > 300);
    check(&phase, None, &found);
    let options = ExactOptions { maximum_residues: 100, ..UNIFORM };
    let refused = unwrap_least_cuts(&phase, None, None, &options);
    assert_eq!(refused, Err(Error::TooManyResidues { residues: found.residues, limit: 100 }));
}

#[test]
fn buffers_and_threads_change_no_bit() {
    let mut rng = Pcg64::seed_from_u64(5);
    let images = [random(23, 31, 0.1, &mut rng), random(31, 17, 0.0, &mut rng), vortices(11, 13)];
    let mut unwrapper = LeastCuts::new(ExactOptions::default());
    let mut out = ExactUnwrapped::default();
    for phase in images.iter().chain(&images) {
        unwrapper.unwrap_into(phase, None, None, &mut out).unwrap();
        let fresh = || unwrap_least_cuts(phase, None, None, &ExactOptions::default()).unwrap();
        std::thread::scope(|scope| {
            let others: Vec<_> = (0..3).map(|_| scope.spawn(fresh)).collect();
            assert!(others.into_iter().all(|other| other.join().unwrap() == out));
        });
    }
}
