//! Start values: robust linear fits to random subsets of the points, of which the least median distance wins.
//!
//! As in the crate `primitives`, whose starts are bound to rays from one camera: here points come from many.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use statistics::upper_median;

use super::surface::{Shape, Surface};
use crate::region::across;

/// Points that a start looks at: more do not change where it leads.
const MOST_POINTS: usize = 300;
/// Random subsets, and their size: of thirty subsets of a plane whose region holds a third of other points, one of twelve with at
/// most three of them is as good as certain, and weights take these down.
const SUBSETS: usize = 30;
const SUBSET: usize = 12;
/// Rounds of weighting.
const ROUNDS: usize = 10;
/// Axes that are tried for a cylinder, on a half sphere: about ten degrees apart.
const AXES: usize = 180;
/// The best of them is turned by this angle in so many directions, and by half as much where none is better, down to a degree: from
/// ten degrees off, the adjustment of a narrow strip does not always find the way.
const FIRST_TURN_RAD: f64 = 0.1;
const LAST_TURN_RAD: f64 = 0.015;
const TURNS: usize = 6;
/// Subsets for each of these axes.
const SUBSETS_AN_AXIS: usize = 4;

/// The surface that leaves the least median distance; `None` where no subset gives any.
pub(crate) fn start(shape: Shape, points: &[Vector3<f64>], seed: u64) -> Option<Surface> {
    let mut random = Pcg64::seed_from_u64(seed);
    let middle = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let near: Vec<Vector3<f64>> = some(points, &mut random).map(|point| point - middle).collect();
    let found = match shape {
        Shape::Plane => best(&near, SUBSETS, &mut random, &plane)?.1,
        Shape::Sphere => best(&near, SUBSETS, &mut random, &sphere)?.1,
        Shape::Cylinder => cylinder(&near, &mut random)?,
    };
    Some(Surface { base: found.base + middle, ..found })
}

/// Not every n-th: that could be a pattern of the points' own.
fn some<'a>(points: &'a [Vector3<f64>], random: &mut Pcg64) -> impl Iterator<Item = &'a Vector3<f64>> + use<'a> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    let count = points.len().min(MOST_POINTS);
    for at in 0..count {
        order.swap(at, random.random_range(at..points.len()));
    }
    order.truncate(count);
    order.into_iter().map(|at| &points[at])
}

/// A circle across each of many axes, of which the best is turned until it gets no better.
fn cylinder(points: &[Vector3<f64>], random: &mut Pcg64) -> Option<Surface> {
    let mut found: Option<(f64, Surface)> = None;
    let attempt = |axis: &Vector3<f64>, random: &mut Pcg64, found: &mut Option<(f64, Surface)>| {
        let [first, second] = across(axis);
        let frame = Matrix3::from_columns(&[first, second, *axis]);
        let circle = |points: &[Vector3<f64>], weights: &[f64]| circle(&frame, points, weights);
        let next = best(points, SUBSETS_AN_AXIS, random, &circle);
        let is_better = next.as_ref().is_some_and(|next| found.as_ref().is_none_or(|(least, _)| next.0 < *least));
        if is_better {
            *found = next;
        }
        is_better
    };
    for index in 0..AXES {
        attempt(&half_sphere(index), random, &mut found);
    }
    let mut step = FIRST_TURN_RAD;
    while step > LAST_TURN_RAD {
        let frame = found.as_ref()?.1.frame;
        let turned = (0..TURNS).map(|turn| {
            let (sine, cosine) = (std::f64::consts::TAU * turn as f64 / TURNS as f64).sin_cos();
            (frame.column(2) + (frame.column(0) * cosine + frame.column(1) * sine) * step).normalize()
        });
        let better = turned.filter(|axis| attempt(axis, random, &mut found)).count();
        if better == 0 {
            step *= 0.5;
        }
    }
    found.map(|(_, surface)| surface)
}

/// Points spread evenly over a half sphere (a spiral of golden angles).
fn half_sphere(index: usize) -> Vector3<f64> {
    let height = (index as f64 + 0.5) / AXES as f64;
    let angle = index as f64 * std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let radius = (1.0 - height * height).sqrt();
    Vector3::new(radius * angle.cos(), radius * angle.sin(), height)
}

type Linear<'a> = &'a dyn Fn(&[Vector3<f64>], &[f64]) -> Option<Surface>;

/// The best of several random subsets, each widened to all points by weights that fall with the distance.
fn best(points: &[Vector3<f64>], subsets: usize, random: &mut Pcg64, fit: Linear<'_>) -> Option<(f64, Surface)> {
    let mut found: Option<(f64, Surface)> = None;
    for _ in 0..subsets {
        let chosen: Vec<Vector3<f64>> = (0..SUBSET).map(|_| points[random.random_range(0..points.len())]).collect();
        let Some(mut surface) = fit(&chosen, &[1.0; SUBSET]) else { continue };
        let mut distances = distances(points, &surface);
        let mut median = median(&distances);
        for _ in 0..ROUNDS {
            let scale = (2.0 * median).max(f64::MIN_POSITIVE);
            let weights: Vec<f64> =
                distances.iter().map(|distance| (1.0 + (distance / scale).powi(2)).recip().powi(2)).collect();
            let Some(next) = fit(points, &weights) else { break };
            let next_distances = self::distances(points, &next);
            let closer = self::median(&next_distances);
            if closer >= median {
                break;
            }
            (surface, distances, median) = (next, next_distances, closer);
        }
        if found.as_ref().is_none_or(|(least, _)| median < *least) {
            found = Some((median, surface));
        }
    }
    found.filter(|(median, _)| median.is_finite())
}

fn distances(points: &[Vector3<f64>], surface: &Surface) -> Vec<f64> {
    points.iter().map(|point| surface.beside(point).distance.abs()).collect()
}

fn median(distances: &[f64]) -> f64 {
    upper_median(&mut distances.to_vec())
}

/// Across the direction in which the points spread least.
fn plane(points: &[Vector3<f64>], weights: &[f64]) -> Option<Surface> {
    let weight: f64 = weights.iter().sum();
    let middle = points.iter().zip(weights).map(|(point, weight)| point * *weight).sum::<Vector3<f64>>() / weight;
    let mut moments = Matrix3::zeros();
    for (point, weight) in points.iter().zip(weights) {
        let way = point - middle;
        moments += way * way.transpose() * *weight;
    }
    if !moments.iter().all(|value| value.is_finite()) {
        return None;
    }
    let eigen = moments.symmetric_eigen();
    let axis = eigen.eigenvectors.column(eigen.eigenvalues.imin()).normalize();
    let [first, second] = across(&axis);
    let frame = Matrix3::from_columns(&[first, second, axis]);
    Some(Surface { shape: Shape::Plane, base: middle, frame, radius: 0.0 })
}

/// `2 cᵀ r + k = |r|²` with `k = R² − |c|²`.
fn sphere(points: &[Vector3<f64>], weights: &[f64]) -> Option<Surface> {
    let row = |point: &Vector3<f64>| ([2.0 * point.x, 2.0 * point.y, 2.0 * point.z, 1.0], point.norm_squared());
    let [x, y, z, k] = solve(points, weights, row)?;
    let base = Vector3::new(x, y, z);
    let radius = (k + base.norm_squared()).sqrt();
    (radius > 0.0).then_some(Surface { shape: Shape::Sphere, base, frame: Matrix3::identity(), radius })
}

/// The same across an axis.
fn circle(frame: &Matrix3<f64>, points: &[Vector3<f64>], weights: &[f64]) -> Option<Surface> {
    let row = |point: &Vector3<f64>| {
        let [x, y] = [frame.column(0).dot(point), frame.column(1).dot(point)];
        ([2.0 * x, 2.0 * y, 1.0], x * x + y * y)
    };
    let [x, y, k] = solve(points, weights, row)?;
    let radius = (k + x * x + y * y).sqrt();
    let base = frame * Vector3::new(x, y, 0.0);
    (radius > 0.0).then_some(Surface { shape: Shape::Cylinder, base, frame: *frame, radius })
}

/// Weighted linear least squares; `None` without a unique answer.
fn solve<const UNKNOWNS: usize>(
    points: &[Vector3<f64>],
    weights: &[f64],
    row_of: impl Fn(&Vector3<f64>) -> ([f64; UNKNOWNS], f64),
) -> Option<[f64; UNKNOWNS]> {
    let mut normal = SMatrix::<f64, UNKNOWNS, UNKNOWNS>::zeros();
    let mut right = SVector::<f64, UNKNOWNS>::zeros();
    for (point, weight) in points.iter().zip(weights) {
        let (row, observed) = row_of(point);
        let row = SVector::<f64, UNKNOWNS>::from(row);
        normal += row * row.transpose() * *weight;
        right += row * (*weight * observed);
    }
    let found = normal.cholesky()?.solve(&right);
    found.iter().all(|value| value.is_finite()).then(|| found.into())
}
