//! What pairs say about a pose, whatever they are pairs of: covariance, and a verdict on degeneracy.
//!
//! Neighbouring pairs share errors, so scores are summed per cell of space before they are squared: a cell counts as
//! one observation. And the noise of normals imitates geometry; the errors of source and target normals are
//! independent, so the cross products of the derivatives along both give the information without that bias, and its
//! scatter between the cells tells whether what is left differs from nothing.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Isometry3, Matrix6, Vector3, Vector6};

use crate::eigen::eigen6;
use crate::error::Result;
use crate::icp::UndeterminedMotion;
use crate::icp::motion::name_motions;
use crate::pose::{symmetrised, tangent_from_centred};

/// Information below this multiple of its own scatter between cells counts as none.
const SIGNIFICANCE: f64 = 2.5;
/// Cells below which their scatter is no estimate.
const FEWEST_CELLS: usize = 20;
/// Share of the largest information that rounding can imitate.
const ROUNDING: f64 = 1e-9;

/// Frame of motions `[dt, rho w]`: the rotation about `centre`, multiplied by the radius, so that all six are lengths.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Centred {
    pub centre: Vector3<f64>,
    pub radius_m: f64,
}

impl Centred {
    /// Derivative of the distance along `direction` of a point at `place` with respect to the motion.
    #[inline]
    pub fn derivative(&self, place: &Vector3<f64>, direction: &Vector3<f64>) -> Vector6<f64> {
        let turn = ((place - self.centre) / self.radius_m).cross(direction);
        Vector6::new(direction.x, direction.y, direction.z, turn.x, turn.y, turn.z)
    }
}

/// What one pair contributes.
#[derive(Debug, Clone)]
pub(crate) struct Contribution {
    /// Where the pair is, target frame.
    pub place: Vector3<f64>,
    /// Weight times derivative times residual.
    pub score: Vector6<f64>,
    /// Slope of the influence times the cross product of the derivatives along both normals.
    pub information: Matrix6<f64>,
}

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

/// Directions of the information, worst first, with the covariance of the score.
pub(crate) struct Verdict {
    frame: Centred,
    directions: Vec<Direction>,
    score: Matrix6<f64>,
}

impl Verdict {
    /// Judges the pairs, those in a cube of `cell_m` as one observation; motions with a predicted sigma above
    /// `max_sigma_m` are undetermined.
    pub fn new(
        contributions: impl Iterator<Item = Contribution>,
        frame: Centred,
        cell_m: f64,
        max_sigma_m: f64,
    ) -> Result<Self> {
        let mut cells: BTreeMap<[i64; 3], Cell> = BTreeMap::new();
        let (mut pairs, mut independent) = (0.0, Matrix6::zeros());
        for one in contributions {
            let cell: [f64; 3] = ((one.place - frame.centre) / cell_m).into();
            let cell = cells.entry(cell.map(|v| v.floor() as i64)).or_default();
            cell.score += one.score;
            cell.information += one.information;
            independent.ger(1.0, &one.score, &one.score, 1.0);
            pairs += 1.0;
        }
        let cells: Vec<Cell> = cells.into_values().collect();
        let information = cells.iter().fold(Matrix6::zeros(), |sum, c| sum + c.information);
        let (values, vectors) = eigen6(&symmetrised(&information), "the information of the pairs")?;
        let independent = independent * (pairs / (pairs - 6.0_f64).max(1.0));
        let count = cells.len() as f64;
        let score = if cells.len() >= FEWEST_CELLS {
            cells.iter().fold(Matrix6::zeros(), |sum, c| sum + c.score * c.score.transpose()) * (count / (count - 6.0))
        } else {
            // Too few cells to estimate from: the pairs of a cell taken as fully dependent.
            independent * (pairs / count.max(1.0))
        };
        let directions = (0..6)
            .map(|k| direction(&cells, &score, values[5], values[k], vectors.column(k).into(), max_sigma_m))
            .collect();
        Ok(Self { frame, directions, score })
    }

    /// Orthonormal undetermined motions `[dt, rho w]`.
    pub fn held(&self) -> Vec<Vector6<f64>> {
        self.directions.iter().filter(|d| !d.determined).map(|d| d.vector).collect()
    }

    /// The undetermined motions, sorted into translations and rotations.
    pub fn undetermined(&self) -> Vec<UndeterminedMotion> {
        let space: Vec<(Vector6<f64>, f64)> =
            self.directions.iter().filter(|d| !d.determined).map(|d| (d.vector, d.sigma_m)).collect();
        name_motions(&space, &self.frame.centre, self.frame.radius_m)
    }

    /// Covariance in the tangent `[dt target axes, dtheta source axes]`: the sandwich of the inverse information and the
    /// covariance of the score. What is not known at all gets the radius as sigma.
    pub fn covariance(&self, pose: &Isometry3<f64>) -> Matrix6<f64> {
        let (known, unknown): (Vec<&Direction>, Vec<&Direction>) =
            self.directions.iter().partition(|d| d.sigma_m.is_finite());
        let basis = DMatrix::from_fn(6, known.len(), |r, c| known[c].vector[r]);
        let inverse =
            DMatrix::from_diagonal(&DVector::from_iterator(known.len(), known.iter().map(|d| 1.0 / d.information)));
        let score = basis.transpose() * self.score * &basis;
        let inside = &basis * (&inverse * score * &inverse) * basis.transpose();
        let mut centred = Matrix6::from_fn(|r, c| inside[(r, c)]);
        for direction in unknown {
            centred += direction.vector * direction.vector.transpose() * self.frame.radius_m.powi(2);
        }
        let to_tangent = tangent_from_centred(pose, &self.frame.centre, self.frame.radius_m);
        symmetrised(&(to_tangent * centred * to_tangent.transpose()))
    }
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
