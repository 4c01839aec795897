//! Which motions the information of pairs determines.

use nalgebra::{DMatrix, Matrix6, Vector6};

use crate::error::Result;
use crate::quality::UndeterminedMotion;
use crate::quality::motion::name_motions;
use rigid_pose::{Centred, eigen6, free_of, symmetrised};

/// Information below this multiple of its own scatter between cells counts as none.
pub const SIGNIFICANCE: f64 = 2.5;
/// Share of the radius beyond whose standard deviation a motion is undetermined, where nothing else is said.
pub const OPEN: f64 = 1.0 / 300.0;
/// Response over information outside which the differences are noise (matching can only weaken the response, to about
/// a half).
const RESPONSE: std::ops::Range<f64> = 0.25..2.0;

/// One eigen-direction of the information.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Direction {
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
    all: [Direction; 6],
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
        // Whether a motion is determined does not hang on how well its deviation is known.
        let all = directions.map(|(vector, information, significant)| {
            let sigma_m =
                if significant { vector.dot(&(score * vector)).max(0.0).sqrt() / information } else { f64::INFINITY };
            Direction { vector, information, sigma_m, determined: sigma_m <= max_sigma_m }
        });
        Ok(Self { all, score: score * enlarged })
    }

    /// All six, worst first.
    pub(crate) fn all(&self) -> &[Direction] {
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

    /// Covariance of motions `[dt, rho w]`: the sandwich `A⁻¹ M A⁻ᵀ` of the covariance of the score and the response A of the score to
    /// the pose (`response`; the information where that has nothing to say). What is not known at all gets the radius as sigma.
    pub fn covariance(&self, radius_m: f64, response: Option<&Matrix6<f64>>) -> Matrix6<f64> {
        let known = || self.all.iter().filter(|d| d.sigma_m.is_finite());
        let inverse = response.and_then(|response| inverse_response(&known().collect::<Vec<_>>(), response));
        let inverse = inverse.unwrap_or_else(|| {
            known().fold(Matrix6::zeros(), |sum, d| sum + d.vector * d.vector.transpose() / d.information)
        });
        let own = inverse * self.score * inverse.transpose();
        let unknown = self.all.iter().filter(|d| !d.sigma_m.is_finite());
        unknown.fold(own, |sum, d| sum + d.vector * d.vector.transpose() * radius_m.powi(2))
    }
}

/// Inverse of the response among the known directions; none where the differences drown in noise.
fn inverse_response(known: &[&Direction], response: &Matrix6<f64>) -> Option<Matrix6<f64>> {
    let basis = DMatrix::from_fn(6, known.len(), |r, c| known[c].vector[r]);
    let reduced = basis.transpose() * response * &basis;
    let plausible = known.iter().enumerate().all(|(k, d)| RESPONSE.contains(&(reduced[(k, k)] / d.information)));
    let inverse = &basis * reduced.try_inverse().filter(|_| plausible)? * basis.transpose();
    Some(Matrix6::from_fn(|r, c| inverse[(r, c)]))
}
