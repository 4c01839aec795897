//! The weighted least-squares surface through given points.

use nalgebra::{Matrix5, Vector3, Vector5};

use super::observation::{Hit, Observation};
use super::surface::{Shape, Surface};
use crate::{Error, Result};

/// Most steps; from a start that is the shape at all, ten do.
const MOST_STEPS: usize = 50;
/// Square of the step at which the surface stands still, in standard deviations: a millionth of one.
const STILL: f64 = 1e-12;

/// Shortest part of a step that is tried: shorter ones get nowhere in so many steps.
const SHORTEST_SHARE: f64 = 1.0 / 256.0;
/// Rounding of a sum of squares.
const COST_ROUNDING: f64 = 1e-9;

/// A surface with the inverse of its normal matrix: the covariance from the points' own errors. Rows beyond a shape's
/// parameters are zero.
#[derive(Debug, Clone)]
pub(crate) struct Adjusted {
    pub(crate) surface: Surface,
    pub(crate) inverse: Matrix5<f64>,
}

/// The surface through the points that are kept, based in their middle.
pub(crate) fn adjust(observations: &[Observation], kept: &[bool], start: &Surface) -> Result<Adjusted> {
    let shape = start.shape;
    let used = || observations.iter().zip(kept).filter(|(_, kept)| **kept).map(|(observation, _)| observation);
    let count = used().count();
    let middle = used().map(|observation| observation.point).sum::<Vector3<f64>>() / count as f64;
    let mut surface = start.based_at(&middle);
    let cost = |surface: &Surface| used().map(|observation| square(observation, surface)).sum::<f64>();
    for _ in 0..MOST_STEPS {
        let hits = used().filter_map(|observation| observation.hit(&surface));
        let (normal, right) = equations(shape, hits);
        let Some(inverse) = inverse(shape, &normal) else { break };
        let step = inverse * right;
        if step.dot(&(normal * step)) < STILL {
            return Ok(Adjusted { surface, inverse });
        }
        let before = cost(&surface);
        let mut share = 1.0;
        let next = |share: f64| surface.moved(&(step * share).into()).based_at(&middle);
        // Where the whole step leads past the minimum, half of it.
        let is_worse = |share: f64| {
            let after = cost(&next(share));
            after.is_nan() || after > before * (1.0 + COST_ROUNDING)
        };
        while share > SHORTEST_SHARE && is_worse(share) {
            share *= 0.5;
        }
        surface = next(share);
        if !(surface.base.iter().all(|value| value.is_finite()) && surface.radius >= 0.0) {
            break;
        }
    }
    Err(open(shape))
}

/// Squared residual over its variance; of a ray that misses the surface, by the distance of its point.
fn square(observation: &Observation, surface: &Surface) -> f64 {
    observation.hit(surface).map_or_else(
        || surface.beside(&observation.point).distance.powi(2) / observation.variance(),
        |hit| hit.residual * hit.residual / hit.variance,
    )
}

/// No surface comes out: the points leave a parameter open.
pub(crate) fn open(shape: Shape) -> Error {
    let (sigma, limit) = (f64::INFINITY, super::robust::LARGEST_UNCERTAINTY);
    Error::NotDetermined { shape, what: "whole of it", sigma, limit }
}

fn equations(shape: Shape, hits: impl Iterator<Item = Hit>) -> (Matrix5<f64>, Vector5<f64>) {
    let mut normal = Matrix5::zeros();
    let mut right = Vector5::zeros();
    for hit in hits {
        let row = Vector5::from(hit.by);
        normal += row * row.transpose() / hit.variance;
        right -= row * (hit.residual / hit.variance);
    }
    for open in shape.parameters()..5 {
        normal[(open, open)] = 1.0;
    }
    (normal, right)
}

/// With columns scaled to one; zero where a shape has no parameter.
fn inverse(shape: Shape, normal: &Matrix5<f64>) -> Option<Matrix5<f64>> {
    let scale = Vector5::from_fn(|at, _| normal[(at, at)].sqrt().recip());
    let scaled = Matrix5::from_fn(|row, column| normal[(row, column)] * scale[row] * scale[column]);
    let mut inverse = scaled.cholesky()?.inverse();
    for row in 0..5 {
        for column in 0..5 {
            let is_open = row.max(column) >= shape.parameters();
            inverse[(row, column)] *= if is_open { 0.0 } else { scale[row] * scale[column] };
        }
    }
    inverse.iter().all(|value| value.is_finite()).then_some(inverse)
}
