//! Which motions the information of pairs determines.

use nalgebra::{DMatrix, DVector, Matrix6, Vector6};

use crate::error::Result;
use crate::quality::UndeterminedMotion;
use crate::quality::motion::name_motions;
use rigid_pose::{Centred, eigen6, free_of, symmetrised};

/// Information below this multiple of its own scatter between cells counts as none.
pub const SIGNIFICANCE: f64 = 2.5;
/// Share of the radius beyond whose standard deviation a motion is undetermined, where nothing else is said.
pub const OPEN: f64 = 1.0 / 300.0;
/// Cells below which their scatter is no estimate.
pub const FEWEST_CELLS: usize = 20;

/// One eigen-direction of the information.
#[derive(Debug, Clone, Copy)]
pub struct Direction {
    /// Unit motion `[dt, rho w]`.
    pub vector: Vector6<f64>,
    /// Eigenvalue of the information along it, 1/metre².
    pub information: f64,
    /// Predicted standard deviation, metre; infinite where the information differs from nothing by too little.
    pub sigma_m: f64,
    /// Whether the standard deviation is below the limit.
    pub determined: bool,
}

/// Directions of the information, worst first, with the covariance of the score.
#[derive(Debug, Clone)]
pub struct Directions {
    all: Vec<Direction>,
    score: Matrix6<f64>,
}

impl Directions {
    /// Judges the eigen-directions of `information`; motions with a predicted sigma above `max_sigma_m` are
    /// undetermined.
    ///
    /// `score`: covariance of the score from the inverse of the information along significant directions, and the factor
    /// by which few degrees of freedom enlarge it. `significant`: whether what the cells say along a unit motion stands
    /// out from its scatter between them. `rounding`: share of the largest information that rounding can imitate.
    ///
    /// # Errors
    /// [`rigid_pose::InputError::Numerical`] where the information is not finite.
    pub fn new(
        information: &Matrix6<f64>,
        score: impl Fn(&Matrix6<f64>) -> (Matrix6<f64>, f64),
        significant: impl Fn(&Vector6<f64>, f64) -> bool,
        rounding: f64,
        max_sigma_m: f64,
    ) -> Result<Self> {
        let (values, vectors) = eigen6(&symmetrised(information), "the information of the pairs")?;
        let directions: [(Vector6<f64>, f64, bool); 6] = std::array::from_fn(|k| {
            let (information, vector): (f64, Vector6<f64>) = (values[k], vectors.column(k).into());
            let significant = information > rounding * values[5] && significant(&vector, information);
            (vector, information, significant)
        });
        let inverse = directions.iter().filter(|(_, _, significant)| *significant);
        let inverse = inverse.fold(Matrix6::zeros(), |sum, (v, i, _)| sum + v * v.transpose() / *i);
        let (score, enlarged) = score(&inverse);
        let judged = directions.into_iter().map(|(vector, information, significant)| {
            let sigma_m =
                if significant { vector.dot(&(score * vector)).max(0.0).sqrt() / information } else { f64::INFINITY };
            Direction { vector, information, sigma_m, determined: sigma_m <= max_sigma_m }
        });
        // Whether a motion is determined does not hang on how well its deviation is known.
        let all = judged.collect();
        Ok(Self { all, score: score * enlarged })
    }

    /// All six, worst first.
    pub fn all(&self) -> &[Direction] {
        &self.all
    }

    /// Projection on the determined motions.
    pub fn free(&self) -> Matrix6<f64> {
        free_of(self.all.iter().filter(|d| !d.determined).map(|d| &d.vector))
    }

    /// The undetermined motions, sorted into translations and rotations.
    pub fn undetermined(&self, frame: &Centred) -> Vec<UndeterminedMotion> {
        let space: Vec<(Vector6<f64>, f64)> =
            self.all.iter().filter(|d| !d.determined).map(|d| (d.vector, d.sigma_m)).collect();
        name_motions(&space, frame)
    }

    /// Columns of the known motions, and the covariance along them: the sandwich `A⁻¹ M A⁻ᵀ` of the covariance of the
    /// score and the response A among them (`response`; their information where that has nothing to say).
    pub fn sandwich(
        &self,
        known: &[&Direction],
        response: impl Fn(&DMatrix<f64>) -> Option<DMatrix<f64>>,
    ) -> (DMatrix<f64>, DMatrix<f64>) {
        let basis = DMatrix::from_fn(6, known.len(), |r, c| known[c].vector[r]);
        let inverse = response(&basis).unwrap_or_else(|| {
            DMatrix::from_diagonal(&DVector::from_iterator(known.len(), known.iter().map(|d| 1.0 / d.information)))
        });
        let score = basis.transpose() * self.score * &basis;
        let inside = &inverse * score * inverse.transpose();
        (basis, inside)
    }
}

/// A matrix along the columns of `basis` as one of all six motions.
pub fn expanded(basis: &DMatrix<f64>, inside: &DMatrix<f64>) -> Matrix6<f64> {
    let full = basis * inside * basis.transpose();
    Matrix6::from_fn(|r, c| full[(r, c)])
}
