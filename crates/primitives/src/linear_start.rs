//! Start values of a primitive: robust linear fits to random subsets of its points.

use nalgebra::{Matrix3, Rotation3, SMatrix, SVector, Unit, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use statistics::upper_median;

use crate::PrimitiveKind;
use crate::surface::Surface;

/// Points that a start looks at: more do not change where it leads.
const MOST_POINTS: usize = 300;
/// Random subsets, and their size.
const SUBSETS: usize = 30;
const SUBSET: usize = 12;
/// Rounds of weighting.
const ROUNDS: usize = 10;
/// Axes that are tried for a cylinder, on a half sphere: about ten degrees apart.
const AXES: usize = 180;

/// Surface and parameters that leave the least median distance; `None` where no subset gives any.
pub(crate) fn start(kind: PrimitiveKind, points: &[Vector3<f64>], seed: u64) -> Option<(Surface, Vec<f64>)> {
    let every = points.len().div_ceil(MOST_POINTS);
    let points: Vec<Vector3<f64>> = points.iter().step_by(every.max(1)).copied().collect();
    let mut random = Pcg64::seed_from_u64(seed);
    match kind {
        PrimitiveKind::Plane => {
            let (_, m) = best(&points, SUBSETS, &mut random, &plane, &plane_distance)?;
            Some((Surface::Plane, m))
        }
        PrimitiveKind::Sphere => {
            let (_, sphere) = best(&points, SUBSETS, &mut random, &ball, &ball_distance)?;
            let far = is_far(&points, |point| point - Vector3::new(sphere[0], sphere[1], sphere[2]));
            Some((Surface::Sphere { far }, sphere))
        }
        PrimitiveKind::Cylinder => cylinder(&points, &mut random),
    }
}

/// A circle in the plane across each of many axes.
fn cylinder(points: &[Vector3<f64>], random: &mut Pcg64) -> Option<(Surface, Vec<f64>)> {
    let mut found: Option<(f64, Matrix3<f64>, Vec<f64>)> = None;
    for index in 0..AXES {
        let frame = across_and_along(half_sphere(index));
        let flat: Vec<Vector3<f64>> = points.iter().map(|point| frame.tr_mul(point)).collect();
        let Some((median, circle)) = best(&flat, 4, random, &circle, &circle_distance) else { continue };
        if found.as_ref().is_none_or(|(least, ..)| median < *least) {
            found = Some((median, frame, circle));
        }
    }
    let (_, frame, circle) = found?;
    let mut along: Vec<f64> = points.iter().map(|point| frame.column(2).dot(point)).collect();
    let along_m = upper_median(&mut along);
    let far = is_far(points, |point| {
        let own = frame.tr_mul(point);
        frame * Vector3::new(own.x - circle[0], own.y - circle[1], 0.0)
    });
    Some((Surface::Cylinder { far, frame, along_m }, vec![0.0, 0.0, circle[0], circle[1], circle[2]]))
}

/// Points spread evenly over a half sphere (a spiral of golden angles).
fn half_sphere(index: usize) -> Vector3<f64> {
    let height = (index as f64 + 0.5) / AXES as f64;
    let angle = index as f64 * std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let radius = (1.0 - height * height).sqrt();
    Vector3::new(radius * angle.cos(), radius * angle.sin(), height)
}

fn across_and_along(axis: Vector3<f64>) -> Matrix3<f64> {
    let turn = Rotation3::rotation_between(&Vector3::z(), &axis).unwrap_or_else(|| {
        // Half a turn has no axis of its own.
        Rotation3::from_axis_angle(&Unit::new_unchecked(Vector3::x()), std::f64::consts::PI)
    });
    turn.into_inner()
}

/// Whether most rays leave the body at their points: the way from the centre to the point goes with the ray.
fn is_far(points: &[Vector3<f64>], from_centre: impl Fn(&Vector3<f64>) -> Vector3<f64>) -> bool {
    let far = points.iter().filter(|point| from_centre(point).dot(point) > 0.0).count();
    2 * far > points.len()
}

type Fit<'a> = &'a dyn Fn(&[Vector3<f64>], &[f64]) -> Option<Vec<f64>>;
type Distance<'a> = &'a dyn Fn(&[f64], &Vector3<f64>) -> f64;

/// The best of several random subsets, each widened to all points by weights that fall with the distance.
fn best(
    points: &[Vector3<f64>],
    subsets: usize,
    random: &mut Pcg64,
    fit: Fit<'_>,
    distance: Distance<'_>,
) -> Option<(f64, Vec<f64>)> {
    let mut found: Option<(f64, Vec<f64>)> = None;
    for _ in 0..subsets {
        let chosen: Vec<Vector3<f64>> = (0..SUBSET).map(|_| points[random.random_range(0..points.len())]).collect();
        let Some(mut parameters) = fit(&chosen, &[1.0; SUBSET]) else { continue };
        let mut median = median_distance(points, &parameters, distance);
        for _ in 0..ROUNDS {
            let scale = (2.0 * median).max(f64::MIN_POSITIVE);
            let weights: Vec<f64> = points
                .iter()
                .map(|point| (1.0 + (distance(&parameters, point) / scale).powi(2)).recip().powi(2))
                .collect();
            let Some(next) = fit(points, &weights) else { break };
            let closer = median_distance(points, &next, distance);
            if closer >= median {
                break;
            }
            (parameters, median) = (next, closer);
        }
        if found.as_ref().is_none_or(|(least, _)| median < *least) {
            found = Some((median, parameters));
        }
    }
    found.filter(|(median, _)| median.is_finite())
}

fn median_distance(points: &[Vector3<f64>], parameters: &[f64], distance: Distance<'_>) -> f64 {
    let mut distances: Vec<f64> = points.iter().map(|point| distance(parameters, point).abs()).collect();
    upper_median(&mut distances)
}

/// `mᵀ r = 1`.
fn plane(points: &[Vector3<f64>], weights: &[f64]) -> Option<Vec<f64>> {
    solve(points, weights, |point| ([point.x, point.y, point.z], 1.0))
}

fn plane_distance(m: &[f64], point: &Vector3<f64>) -> f64 {
    let m = Vector3::new(m[0], m[1], m[2]);
    (m.dot(point) - 1.0) / m.norm()
}

/// `2 cᵀ r + k = |r|²` with `k = R² − |c|²`.
fn ball(points: &[Vector3<f64>], weights: &[f64]) -> Option<Vec<f64>> {
    let row = |point: &Vector3<f64>| ([2.0 * point.x, 2.0 * point.y, 2.0 * point.z, 1.0], point.norm_squared());
    let mut found = solve(points, weights, row)?;
    found[3] = (found[3] + found[..3].iter().map(|c| c * c).sum::<f64>()).sqrt();
    (found[3] > 0.0).then_some(found)
}

fn ball_distance(sphere: &[f64], point: &Vector3<f64>) -> f64 {
    (point - Vector3::new(sphere[0], sphere[1], sphere[2])).norm() - sphere[3]
}

/// The same in the first two coordinates.
fn circle(points: &[Vector3<f64>], weights: &[f64]) -> Option<Vec<f64>> {
    let row = |point: &Vector3<f64>| ([2.0 * point.x, 2.0 * point.y, 1.0], point.xy().norm_squared());
    let mut found = solve(points, weights, row)?;
    found[2] = (found[2] + found[0] * found[0] + found[1] * found[1]).sqrt();
    (found[2] > 0.0).then_some(found)
}

fn circle_distance(circle: &[f64], point: &Vector3<f64>) -> f64 {
    (point.x - circle[0]).hypot(point.y - circle[1]) - circle[2]
}

/// Weighted linear least squares; `None` without a unique answer.
fn solve<const UNKNOWNS: usize>(
    points: &[Vector3<f64>],
    weights: &[f64],
    row_of: impl Fn(&Vector3<f64>) -> ([f64; UNKNOWNS], f64),
) -> Option<Vec<f64>> {
    let mut normal = SMatrix::<f64, UNKNOWNS, UNKNOWNS>::zeros();
    let mut right = SVector::<f64, UNKNOWNS>::zeros();
    for (point, weight) in points.iter().zip(weights) {
        let (row, observed) = row_of(point);
        let row = SVector::<f64, UNKNOWNS>::from(row);
        normal += row * row.transpose() * *weight;
        right += row * (*weight * observed);
    }
    let found = normal.cholesky()?.solve(&right);
    found.iter().all(|value| value.is_finite()).then(|| found.as_slice().to_vec())
}
