//! What the mean over a curved cell is off the surface.
//!
//! The mean height of points about their centre is that of the surface there and half the trace of curvature times second
//! moments. The curvature comes from the fused points around, among which it is known much better than inside of a
//! cell; where these do not tell, it is unknown with the deviation [`BEND`].

use nalgebra::{Matrix6, Vector3, Vector6};
use rayon::prelude::*;
use statistics::Distribution;

use super::estimate::Estimate;
use crate::lattice::{Runs, neighbour, neighbours};
use crate::patches::{ONE_SURFACE, Seed, largest_sum, variance_within};

/// Probability that a place with a weak plane that goes on the surface around it is given up.
const CONTINUES_LEVEL: f64 = 0.05;
/// Standard deviation of curvatures where nothing is known of them, one over cells: a radius of four cells. Surfaces that bend
/// more need smaller cells.
const BEND: f64 = 0.25;
/// The same where a surface is continued to a place beside: a radius of thirty cells. Larger: planes reach beyond their edges.
const CONTINUES: f64 = 0.03;
/// Height of a mean over its surface, cells, below which it is flat: the mean height of frames that see different parts of a
/// cell differs by no more.
const FLAT: f64 = 0.005;
/// Cosine of the angle beyond which a surface is the other side of a wall and no edge.
const OTHER_SIDE: f64 = -0.9;
/// Standard deviation, cells, of the height of a place that another surface meets, where its own plane is weak or those around lie on no
/// one surface: what points of the other surface leave after all tests, in simulated rooms 0.04 to 0.06.
const MEETS: f64 = 0.05;
/// The same where both are so: simulated 0.16 to 0.18, and some far off. Larger: squares there are below one.
const ENDS: f64 = 0.15;
/// The same of other places with weak planes, where fewer than [`ENOUGH`] places around tell what surface goes on there: behind their edge
/// nothing was seen. Of those that go on one nothing is left in simulated rooms (squared error over variance 0.9 without it).
const WEAK: f64 = 0.03;
/// Neighbours with firm planes that a surface is told by; with fewer, all serve.
const ENOUGH: usize = 6;
/// Cells around that are asked; one more where the plane is weak.
const REACH: i64 = 2;
/// Largest height of a neighbour over the plane, parts of its distance: the tangent of 30°.
const STEEPEST: f64 = 0.577;
/// Probability that neighbours on one smooth surface are taken for those of an edge.
const LEVEL: f64 = 1e-3;

/// Largest height of a place with a weak plane off the surface that goes on around it, standard deviations.
pub(crate) fn largest_off() -> f64 {
    Distribution::Normal.critical(CONTINUES_LEVEL)
}

/// What a place differs from the surface around it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bend {
    /// Height of the mean above the surface, metre.
    pub above_m: f64,
    /// Its variance, square metre.
    pub variance: f64,
    /// Height of the place over the surface that goes on from around it over its standard deviation; of places that have
    /// their plane from a cell beside, zero of others.
    pub off: f64,
    /// Part of the variance of the place's own points that is left where `off` is not larger than [`largest_off`].
    pub left: f64,
    /// Normal of the surface around as the places there tell it, without the points of this one; the place's own where they tell none.
    pub normal: Vector3<f64>,
    /// Whether the surface is flat around the place, and no other one meets it there.
    pub is_flat: bool,
    /// Whether the places around lie on one surface.
    goes_on: bool,
}

/// What each place differs from the places around that have planes of their own.
pub(crate) fn bends(seeds: &[(u64, Seed)], estimates: &[Estimate], voxel_m: f64) -> Vec<Bend> {
    let cells = Runs::new(seeds.iter().map(|(key, _)| *key));
    let (near, far) = (neighbours(REACH), neighbours(REACH + 1));
    let deviations = Distribution::Normal.upper_quantile(LEVEL);
    let within = variance_within(largest_off());
    (0..seeds.len())
        .into_par_iter()
        .with_min_len(64)
        .map(|at| {
            let meets = |other: usize| {
                let cosine = estimates[other].normal.dot(&estimates[at].normal);
                let apart = (estimates[other].position - estimates[at].position).norm();
                cosine < ONE_SURFACE && cosine > OTHER_SIDE && apart < REACH as f64 * voxel_m
            };
            let is_weak = seeds[at].1.is_weak;
            let around = if is_weak { &far } else { &near };
            let places: Vec<usize> = around.iter().flat_map(|by| cells.of(neighbour(seeds[at].0, *by))).collect();
            let is_edge = places.iter().any(|other| meets(*other));
            let in_layer = |other: &&usize| **other != at && seeds[**other].1.layer == seeds[at].1.layer;
            let firm = || places.iter().filter(in_layer).filter(|other| !seeds[**other].1.is_weak);
            let bend = if firm().count() >= ENOUGH {
                let tested = is_weak.then_some(within);
                bend(&estimates[at], tested, firm().map(|other| &estimates[*other]), voxel_m, deviations)
            } else {
                let all = places.iter().filter(in_layer).map(|other| &estimates[*other]);
                bend(&estimates[at], None, all, voxel_m, deviations)
            };
            let edge = match (is_edge, bend.goes_on) {
                (true, false) if is_weak => ENDS,
                (true, goes_on) if is_weak || !goes_on => MEETS,
                (false, false) if is_weak => WEAK,
                _ => 0.0,
            };
            let variance = bend.variance + (edge * voxel_m).powi(2);
            Bend { variance, is_flat: bend.is_flat && !is_edge && !is_weak, ..bend }
        })
        .collect()
}

/// `tested`: the part of a variance that is left where [`largest_off`] is the largest height; `None` where a place is not tested by it.
fn bend<'a>(
    place: &Estimate,
    tested: Option<f64>,
    others: impl Iterator<Item = &'a Estimate>,
    voxel_m: f64,
    deviations: f64,
) -> Bend {
    let [s, t] = place.tangents;
    let mut rows: Vec<(Vector6<f64>, f64, f64)> = Vec::new();
    for other in others {
        let apart = (other.position - place.position) / voxel_m;
        let height = place.normal.dot(&apart);
        let (u, v) = (s.dot(&apart), t.dot(&apart));
        let variance = other.own_variance() / (voxel_m * voxel_m);
        let slack = 4.0 * (variance + place.own_variance() / (voxel_m * voxel_m)).sqrt();
        if other.normal.dot(&place.normal) > ONE_SURFACE && height.abs() <= STEEPEST * u.hypot(v) + slack {
            rows.push((Vector6::new(1.0, u, v, 0.5 * u * u, u * v, 0.5 * v * v), height, 1.0 / variance));
        }
    }
    let moments = place.moments / (voxel_m * voxel_m);
    let by_curvature = Vector3::new(0.5 * moments[0], moments[1], 0.5 * moments[2]);
    let around = solve(&rows, deviations, CONTINUES);
    let goes_on = rows.len() >= ENOUGH && around.is_some();
    let (height, off, part) = around.map_or((0.0, 0.0, 0.0), |(solution, covariance)| {
        let own = place.own_variance() / (voxel_m * voxel_m);
        let variance = covariance[(0, 0)] + own;
        (solution[0], solution[0] / variance.sqrt(), own / variance)
    });
    // At an edge, the mean of two surfaces: where it is off what goes on, it may be off by as much.
    let leaves = if off.abs() > deviations { height * height } else { 0.0 };
    let (off, left) = tested.map_or((0.0, 1.0), |within| (off, 1.0 - part * (1.0 - within)));
    let variance = by_curvature.norm_squared() * (BEND * BEND);
    let unknown =
        Bend { above_m: 0.0, variance: variance + leaves, off, left, normal: place.normal, is_flat: false, goes_on };
    let bend = solve(&rows, deviations, BEND).map_or(unknown, |(solution, covariance)| {
        let above = by_curvature.dot(&solution.fixed_rows::<3>(3));
        let variance = by_curvature.dot(&(covariance.fixed_view::<3, 3>(3, 3) * by_curvature));
        let normal = (place.normal - s * solution[1] - t * solution[2]).normalize();
        let is_flat = leaves == 0.0 && above.abs() < FLAT && variance < FLAT * FLAT;
        Bend { above_m: above * voxel_m, variance: variance + leaves, off, left, normal, is_flat, goes_on }
    });
    Bend { variance: bend.variance * voxel_m * voxel_m, ..bend }
}

/// Height, inclinations and curvatures from neighbours, in cells; `None` where they do not lie on such a surface.
fn solve(rows: &[(Vector6<f64>, f64, f64)], deviations: f64, bend: f64) -> Option<(Vector6<f64>, Matrix6<f64>)> {
    let bend = 1.0 / (bend * bend);
    // A cell and a radian are next to nothing known; they keep the equations regular where neighbours are few.
    let mut normal = Matrix6::from_diagonal(&Vector6::new(1.0, 1.0, 1.0, bend, bend, bend));
    let mut right = Vector6::zeros();
    for (row, height, weight) in rows {
        normal += row * row.transpose() * *weight;
        right += row * (weight * height);
    }
    let factor = normal.cholesky()?;
    let solution = factor.solve(&right);
    let misfit: f64 = rows.iter().map(|(row, height, weight)| weight * (height - row.dot(&solution)).powi(2)).sum();
    let dof = rows.len().saturating_sub(6) as f64;
    (dof < 1.0 || misfit <= largest_sum(dof, deviations)).then(|| (solution, factor.inverse()))
}
