use crate::cofactors::cofactor::Cofactor;
use crate::equations::constraints::Constraints;
use crate::equations::normal::{NormalEquations, Singular};
use crate::equations::orthogonal::OrthogonalFactor;
use crate::equations::system::{System, SystemFactor};
use crate::linearised::layout::Layout;
use crate::linearised::linearisation::Linearisation;
use crate::{Combination, Error, Result, cofactors::null_space};

/// Condition of the normal equations (unit diagonal) up to which they are trusted: at least six digits are left to the
/// covariance. Beyond, the Jacobian is factorised itself, where it fits.
const TRUSTED: f64 = 1e10;
/// Condition beyond which normal equations say nothing any more: ten times the rounding of a sum of a hundred products.
pub(crate) const HOPELESS: f64 = 1e14;
/// Singular values below this share of the largest one (columns of unit length) are zero: rounding of the Jacobian's
/// entries leaves some 1e-15, and a parameter that is known 1e11 times worse than the others is not known.
const RANK_TOLERANCE: f64 = 1e-11;

/// Linearised problem to be decided upon.
pub(crate) struct Problem<'p> {
    pub(crate) layout: &'p Layout,
    pub(crate) linearisation: &'p Linearisation,
    pub(crate) constraints: &'p Constraints,
    pub(crate) system: &'p System,
}

/// A factorisation that may be trusted.
pub(crate) enum Factor {
    Normal(SystemFactor),
    Orthogonal(Box<OrthogonalFactor>),
}

impl Factor {
    /// The undamped step.
    pub(crate) fn step(&self, gradient: &[f64]) -> Vec<f64> {
        match self {
            Self::Normal(factor) => factor.solve(gradient, 1.0),
            Self::Orthogonal(factor) => factor.solve(),
        }
    }
}

impl Problem<'_> {
    /// The best factorisation, or `None` where the unknowns are not determined.
    pub(crate) fn factorise(&self) -> Result<Option<Factor>> {
        let normal = match self.system.factor(self.constraints, None) {
            Ok(factor) => Some((factor.condition(self.system), factor)),
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
        Ok(usable.map(|(_, factor)| Factor::Normal(factor)))
    }

    /// Cofactors, after the explicit decision on rank and datum.
    pub(crate) fn cofactor(&self, names: &[String]) -> Result<Cofactor> {
        if self.layout.unknowns == 0 {
            return Ok(Cofactor::dense(Vec::new(), Vec::new(), 0.0));
        }
        let Some(factor) = self.factorise()? else { return Err(self.defect(names)?) };
        match factor {
            Factor::Normal(factor) => {
                factor.check_datum()?;
                Ok(match factor {
                    SystemFactor::Dense(factor) => {
                        let (matrix, trace) = factor.cofactor();
                        Cofactor::dense(matrix, factor.scale, trace)
                    }
                    SystemFactor::Eliminated(factor) => Cofactor::eliminated(*factor),
                })
            }
            Factor::Orthogonal(factor) => {
                self.check_datum(names)?;
                let Some((matrix, trace)) = factor.cofactor() else { return Err(self.defect(names)?) };
                Ok(Cofactor::dense(matrix, factor.scale, trace))
            }
        }
    }

    /// Inner constraints are checked on the normal equations in any case.
    fn check_datum(&self, names: &[String]) -> Result<()> {
        if self.constraints.count == self.constraints.first_inner {
            return Ok(());
        }
        match self.system.factor(self.constraints, None) {
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
            match self.system {
                System::Dense(normal) => self.null_space_of_normal(normal)?,
                System::Eliminated(normal) => null_space::find(self, normal)?,
            }
        };
        Ok(Error::RankDeficient { defect: directions.len(), combinations: Combination::basis(directions, names) })
    }

    fn null_space_of_normal(&self, normal: &NormalEquations) -> Result<Vec<Vec<f64>>> {
        let scale = normal.scale();
        let n = scale.len();
        let mut matrix = normal.matrix.clone();
        crate::equations::normal::equilibrate(&mut matrix, &scale, &self.constraints.scaled(&scale));
        let (values, vectors) = dense_matrices::symmetric_eigen(&matrix, n)?;
        let limit = values.last().copied().unwrap_or(0.0) / HOPELESS;
        // The smallest one is named in any case: the decision against the matrix has fallen already.
        let count = values.iter().filter(|&&value| value <= limit).count().max(1);
        Ok(vectors.chunks_exact(n.max(1)).take(count).map(<[f64]>::to_vec).collect())
    }
}
