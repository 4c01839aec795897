use crate::constraints::Constraints;
use crate::layout::Layout;
use crate::linearisation::Linearisation;
use crate::normal::{NormalEquations, NormalFactor, Singular, equilibrated};
use crate::orthogonal::OrthogonalFactor;
use crate::{Combination, Error, Result, dense};

/// Condition of the normal equations (unit diagonal) up to which they are trusted: at least six digits are left to the
/// covariance. Beyond, the Jacobian is factorised itself, where it fits.
const TRUSTED: f64 = 1e10;
/// Condition beyond which normal equations say nothing any more: ten times the rounding of a sum of a hundred products.
const HOPELESS: f64 = 1e14;
/// Singular values below this share of the largest one (columns of unit length) are zero: rounding of the Jacobian's
/// entries leaves some 1e-15, and a parameter that is known 1e11 times worse than the others is not known.
const RANK_TOLERANCE: f64 = 1e-11;

/// Linearised problem to be decided upon.
pub(crate) struct Problem<'p> {
    pub(crate) layout: &'p Layout,
    pub(crate) linearisation: &'p Linearisation,
    pub(crate) constraints: &'p Constraints,
    pub(crate) normal: &'p NormalEquations,
}

/// A factorisation that may be trusted.
pub(crate) enum Factor {
    Normal(Box<NormalFactor>),
    Orthogonal(Box<OrthogonalFactor>),
}

/// Cofactor matrix of unknowns in units of `scale`.
pub(crate) struct Cofactor {
    pub(crate) matrix: Vec<f64>,
    pub(crate) scale: Vec<f64>,
    /// Bound of the condition of the whitened Jacobian with unit columns.
    pub(crate) condition: f64,
}

impl Problem<'_> {
    /// The best factorisation, or `None` where the unknowns are not determined.
    pub(crate) fn factorise(&self) -> Result<Option<Factor>> {
        let normal = match NormalFactor::new(self.normal, self.constraints, None) {
            Ok(factor) => Some((factor.condition(self.normal), factor)),
            Err(Singular::Constraints(error)) => return Err(error),
            Err(Singular::Normal) => None,
        };
        let trusted = normal.as_ref().is_some_and(|(condition, _)| *condition <= TRUSTED);
        let dense = OrthogonalFactor::is_cheap(self.layout) || !trusted && OrthogonalFactor::fits(self.layout);
        if dense {
            let factor = OrthogonalFactor::new(self.layout, self.linearisation, self.constraints)?;
            return Ok(factor.is_determined(RANK_TOLERANCE)?.then(|| Factor::Orthogonal(Box::new(factor))));
        }
        let usable = normal.filter(|(condition, _)| *condition <= HOPELESS);
        Ok(usable.map(|(_, factor)| Factor::Normal(Box::new(factor))))
    }

    /// Cofactor matrix, after the explicit decision on rank and datum.
    pub(crate) fn cofactor(&self, names: &[String]) -> Result<Cofactor> {
        if self.layout.unknowns == 0 {
            return Ok(Cofactor { matrix: Vec::new(), scale: Vec::new(), condition: 1.0 });
        }
        let Some(factor) = self.factorise()? else { return Err(self.defect(names)?) };
        let (matrix, scale, trace) = match factor {
            Factor::Normal(factor) => {
                factor.check_datum()?;
                let (matrix, trace) = factor.cofactor();
                (matrix, factor.scale, trace)
            }
            Factor::Orthogonal(factor) => {
                self.check_datum(names)?;
                let Some((matrix, trace)) = factor.cofactor() else { return Err(self.defect(names)?) };
                (matrix, factor.scale, trace)
            }
        };
        Ok(Cofactor { matrix, scale, condition: (trace * self.layout.unknowns as f64).sqrt() })
    }

    /// Inner constraints are checked on the normal equations in any case.
    fn check_datum(&self, names: &[String]) -> Result<()> {
        if self.constraints.count == self.constraints.first_inner {
            return Ok(());
        }
        match NormalFactor::new(self.normal, self.constraints, None) {
            Ok(factor) => factor.check_datum(),
            Err(Singular::Constraints(error)) => Err(error),
            Err(Singular::Normal) => Err(self.defect(names)?),
        }
    }

    /// Names what is not determined. Called only where [`Self::factorise`] found a defect.
    pub(crate) fn defect(&self, names: &[String]) -> Result<Error> {
        let directions = if OrthogonalFactor::fits(self.layout) {
            let factor = OrthogonalFactor::new(self.layout, self.linearisation, self.constraints)?;
            factor.null_space(RANK_TOLERANCE)?
        } else {
            self.null_space_of_normal()?
        };
        Ok(Error::RankDeficient { defect: directions.len(), combinations: Combination::basis(directions, names) })
    }

    fn null_space_of_normal(&self) -> Result<Vec<Vec<f64>>> {
        let scale = self.normal.scale();
        let n = scale.len();
        let matrix = equilibrated(self.normal, &scale, &self.constraints.scaled(&scale));
        let (values, vectors) = dense::symmetric_eigen(&matrix, n)?;
        let limit = values.last().copied().unwrap_or(0.0) / HOPELESS;
        // The smallest one is named in any case: the decision against the matrix has fallen already.
        let count = values.iter().filter(|&&value| value <= limit).count().max(1);
        Ok(vectors.chunks_exact(n.max(1)).take(count).map(<[f64]>::to_vec).collect())
    }
}

impl NormalFactor {
    /// Estimate of the condition of the equilibrated matrix in the 1-norm [Higham1988].
    fn condition(&self, normal: &NormalEquations) -> f64 {
        let n = self.scale.len();
        let norm = self.norm(normal);
        let mut x = vec![1.0 / n as f64; n];
        let mut estimate = 0.0;
        // Higham: four rounds at the most, nearly always two.
        for _ in 0..4 {
            let mut y = x.clone();
            self.solve_scaled(&mut y);
            let size: f64 = y.iter().map(|v| v.abs()).sum();
            if !size.is_finite() {
                return f64::INFINITY;
            }
            if size <= estimate {
                break;
            }
            estimate = size;
            let mut z: Vec<f64> = y.iter().map(|v| v.signum()).collect();
            self.solve_scaled(&mut z);
            let start = (0, 0.0_f64);
            let (place, _) = z.iter().enumerate().fold(start, |b, (i, v)| if v.abs() > b.1 { (i, v.abs()) } else { b });
            x.fill(0.0);
            x[place] = 1.0;
        }
        // The alternating vector catches the matrices for which the climb stops early.
        let alternating =
            |i: usize| (1.0 + i as f64 / (n.max(2) - 1) as f64) * if i.is_multiple_of(2) { 1.0 } else { -1.0 };
        let mut y: Vec<f64> = (0..n).map(alternating).collect();
        self.solve_scaled(&mut y);
        let other = 2.0 * y.iter().map(|v| v.abs()).sum::<f64>() / (3.0 * n as f64);
        norm * estimate.max(other)
    }
}
