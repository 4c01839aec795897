//! What the pairs say about the pose: covariance, and a verdict on degeneracy.
//!
//! Two things make the inverse normal matrix of an ICP far too optimistic. Neighbouring pairs share errors (target
//! points used twice, normals from overlapping windows, the same unmodelled bump), so scores are summed per cell of
//! space before they are squared: a cell counts as one observation (a sandwich estimate, clustered). And the noise of
//! the normals imitates geometry: on one plane, n noisy normals say something about sliding that is not there. The
//! normals of source and target have independent errors, so the *cross* products of the two give the information
//! without that bias, and its scatter between the cells tells whether what is left differs from nothing.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Matrix6, Vector6};

use super::motion::{UndeterminedMotion, name_motions};
use super::system::System;
use crate::eigen::eigen6;
use crate::error::Result;
use crate::parts::Rows;
use crate::pose::{symmetrised, tangent_from_centred};

/// Cells across the rms radius of the pairs.
const CELLS_PER_RADIUS: f64 = 8.0;
/// Information below this multiple of its own scatter between cells counts as none.
const SIGNIFICANCE: f64 = 2.5;
/// Cells below which their scatter is no estimate.
const FEWEST_CELLS: usize = 20;
/// Response over information outside which the differences are noise (matching can only weaken the response, to about
/// a half).
const SMALLEST_RESPONSE: f64 = 0.25;
const LARGEST_RESPONSE: f64 = 2.0;
/// Share of the largest information that rounding can imitate.
const ROUNDING: f64 = 1e-9;

/// What one cell of space contributes.
#[derive(Default)]
struct Cell {
    score: Vector6<f64>,
    information: Matrix6<f64>,
}

/// One eigen-direction of the information.
struct Direction {
    vector: Vector6<f64>,
    information: f64,
    sigma_m: f64,
    determined: bool,
}

/// What the residuals consist of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Residuals {
    /// The clouds are still apart: what neighbouring residuals share is no error, and would hold what can be solved.
    Misaligned,
    /// Errors: what neighbouring residuals share counts.
    Settled,
}

/// Directions of the information, worst first, with the covariance of the score and the frame they are in.
pub(crate) struct Verdict {
    directions: Vec<Direction>,
    score: Matrix6<f64>,
}

impl Verdict {
    /// Judges the pairs of `system`; motions with a predicted sigma above `max_sigma_m` are undetermined.
    pub(crate) fn new(system: &System<'_>, max_sigma_m: f64, residuals: Residuals) -> Result<Self> {
        let cells = cells(system);
        let information = cells.iter().fold(Matrix6::zeros(), |sum, c| sum + c.information);
        let (values, vectors) = eigen6(&symmetrised(&information), "the information of the pairs")?;
        let score = match residuals {
            Residuals::Misaligned => independent_scores(system),
            Residuals::Settled => clustered_scores(system, &cells),
        };
        let directions = (0..6)
            .map(|k| direction(&cells, &score, values[5], values[k], vectors.column(k).into(), max_sigma_m))
            .collect();
        Ok(Self { directions, score })
    }

    /// Orthonormal undetermined motions `[dt, rho w]`.
    pub(crate) fn held(&self) -> Vec<Vector6<f64>> {
        self.directions.iter().filter(|d| !d.determined).map(|d| d.vector).collect()
    }

    /// A step `[dt, rho w]` over the standard deviation, along the determined motion where that is largest.
    pub(crate) fn over_sigma(&self, step: &Vector6<f64>) -> f64 {
        let determined = self.directions.iter().filter(|d| d.determined);
        determined.map(|d| d.vector.dot(step).abs() / d.sigma_m.max(f64::MIN_POSITIVE)).fold(0.0, f64::max)
    }

    /// The undetermined motions, sorted into translations and rotations.
    pub(crate) fn undetermined(&self, system: &System<'_>) -> Vec<UndeterminedMotion> {
        let space: Vec<(Vector6<f64>, f64)> =
            self.directions.iter().filter(|d| !d.determined).map(|d| (d.vector, d.sigma_m)).collect();
        name_motions(&space, &system.centre(), system.radius_m())
    }

    /// Covariance in the tangent `[dt target axes, dtheta source axes]`: the sandwich `A⁻¹ M A⁻ᵀ` with the response A of
    /// the score. What is not known at all gets the radius of the pairs as sigma.
    pub(crate) fn covariance(&self, system: &System<'_>, response: &Matrix6<f64>) -> Matrix6<f64> {
        let (known, unknown): (Vec<&Direction>, Vec<&Direction>) =
            self.directions.iter().partition(|d| d.sigma_m.is_finite());
        let (basis, inside) = self.sandwich(&known, response);
        let mut centred = expanded(&basis, &inside);
        for direction in unknown {
            centred += direction.vector * direction.vector.transpose() * system.radius_m().powi(2);
        }
        in_tangent(system, &centred)
    }

    /// Inverse of the covariance along the determined motions, zero along the others; in the tangent of
    /// [`Verdict::covariance`].
    pub(crate) fn information(&self, system: &System<'_>, response: &Matrix6<f64>) -> Matrix6<f64> {
        let known: Vec<&Direction> = self.directions.iter().filter(|d| d.determined).collect();
        let (basis, inside) = self.sandwich(&known, response);
        let inverse = inside.try_inverse().unwrap_or_else(|| DMatrix::zeros(known.len(), known.len()));
        let centred = expanded(&basis, &inverse);
        let pose = system.scene().moment.pose;
        let to_tangent = tangent_from_centred(&pose, &system.centre(), system.radius_m());
        let from_tangent = to_tangent.try_inverse().unwrap_or_else(Matrix6::zeros);
        symmetrised(&(from_tangent.transpose() * centred * from_tangent))
    }

    /// Columns of the known motions, and the covariance along them.
    fn sandwich(&self, known: &[&Direction], response: &Matrix6<f64>) -> (DMatrix<f64>, DMatrix<f64>) {
        let basis = DMatrix::from_fn(6, known.len(), |r, c| known[c].vector[r]);
        let inverse = inverse_response(known, &basis, response);
        let score = basis.transpose() * self.score * &basis;
        let inside = &inverse * score * inverse.transpose();
        (basis, inside)
    }
}

fn expanded(basis: &DMatrix<f64>, inside: &DMatrix<f64>) -> Matrix6<f64> {
    let full = basis * inside * basis.transpose();
    Matrix6::from_fn(|r, c| full[(r, c)])
}

fn in_tangent(system: &System<'_>, centred: &Matrix6<f64>) -> Matrix6<f64> {
    let pose = system.scene().moment.pose;
    let to_tangent = tangent_from_centred(&pose, &system.centre(), system.radius_m());
    symmetrised(&(to_tangent * centred * to_tangent.transpose()))
}

/// Inverse of the response among the known directions; that of their information where the differences drown in noise.
fn inverse_response(known: &[&Direction], basis: &DMatrix<f64>, response: &Matrix6<f64>) -> DMatrix<f64> {
    let reduced = basis.transpose() * response * basis;
    let plausible = known.iter().enumerate().all(|(k, d)| {
        let ratio = reduced[(k, k)] / d.information;
        (SMALLEST_RESPONSE..LARGEST_RESPONSE).contains(&ratio)
    });
    let from_information =
        || DMatrix::from_diagonal(&DVector::from_iterator(known.len(), known.iter().map(|d| 1.0 / d.information)));
    if plausible { reduced.try_inverse().unwrap_or_else(from_information) } else { from_information() }
}

fn direction(
    cells: &[Cell],
    score: &Matrix6<f64>,
    largest: f64,
    information: f64,
    vector: Vector6<f64>,
    max_sigma_m: f64,
) -> Direction {
    let scatter = cells.iter().map(|c| vector.dot(&(c.information * vector)).powi(2)).sum::<f64>().sqrt();
    let significant = information > SIGNIFICANCE * scatter && information > ROUNDING * largest;
    let sigma_m = if significant { vector.dot(&(score * vector)).max(0.0).sqrt() / information } else { f64::INFINITY };
    Direction { vector, information, sigma_m, determined: sigma_m <= max_sigma_m }
}

/// Covariance of the summed score from the scatter of its sums over cells.
fn clustered_scores(system: &System<'_>, cells: &[Cell]) -> Matrix6<f64> {
    let count = cells.len() as f64;
    if cells.len() >= FEWEST_CELLS {
        let sum = cells.iter().fold(Matrix6::zeros(), |sum, c| sum + c.score * c.score.transpose());
        return sum * (count / (count - 6.0));
    }
    // Too few cells to estimate from: the pairs of a cell taken as fully dependent.
    independent_scores(system) * (system.pairs().len() as f64 / count.max(1.0))
}

/// Covariance of the summed score of pairs that share nothing.
fn independent_scores(system: &System<'_>) -> Matrix6<f64> {
    let pairs = system.pairs().len() as f64;
    let mut rows = Rows::default();
    let mut sum = Matrix6::zeros();
    for i in 0..system.pairs().len() {
        let score = system.score(i, &mut rows);
        sum += score * score.transpose();
    }
    sum * (pairs / (pairs - 6.0).max(1.0))
}

fn cells(system: &System<'_>) -> Vec<Cell> {
    let size = system.radius_m() / CELLS_PER_RADIUS;
    let mut cells: BTreeMap<[i64; 3], Cell> = BTreeMap::new();
    let mut buffers = [Rows::default(), Rows::default()];
    let twin_weight = system.twin_weight();
    for (i, pair) in system.pairs().iter().enumerate() {
        let place = (pair.moved - system.centre()) / size;
        let cell = cells.entry([place.x.floor() as i64, place.y.floor() as i64, place.z.floor() as i64]).or_default();
        cell.score += system.score(i, &mut buffers[0]);
        let (_, slope) = system.weights(i);
        add_information(system, i, slope * twin_weight, &mut buffers, &mut cell.information);
    }
    cells.into_values().collect()
}

/// Information of a pair: the symmetric products of its derivatives from independent measurements.
fn add_information(system: &System<'_>, i: usize, weight: f64, [a, b]: &mut [Rows; 2], information: &mut Matrix6<f64>) {
    let pair = &system.pairs()[i];
    system.twins(pair, a, b);
    for (row, twin) in a.as_slice().iter().zip(b.as_slice()) {
        let (row, twin) = (system.jacobian(pair, row), system.jacobian(pair, twin));
        information.ger(0.5 * weight, &row, &twin, 1.0);
        information.ger(0.5 * weight, &twin, &row, 1.0);
    }
}
