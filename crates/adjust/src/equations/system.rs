//! Normal equations in one of their two forms.

use crate::equations::block_normal::BlockNormal;
use crate::equations::constraints::Constraints;
use crate::equations::elimination::EliminatedFactor;
use crate::equations::normal::{NormalEquations, NormalFactor, Singular, unit_scale};
use crate::equations::structure::Structure;
use crate::linearised::layout::Layout;
use crate::linearised::linearisation::Linearisation;
use crate::{Adjustment, Error, Result};

/// Unknowns of a dense matrix of 1.8 GB.
pub(crate) const LARGEST: usize = 15_000;

/// Normal equations, dense or in blocks.
#[derive(Debug, Clone)]
pub(crate) enum System {
    Dense(NormalEquations),
    Eliminated(Box<BlockNormal>),
}

/// Factor of the normal equations, perhaps damped.
#[derive(Debug)]
pub(crate) enum SystemFactor {
    Dense(Box<NormalFactor>),
    Eliminated(Box<EliminatedFactor>),
}

impl System {
    /// Chooses the form and takes the memory.
    pub(crate) fn new(adjustment: &Adjustment<'_>, layout: &Layout) -> Result<Self> {
        let structure = Structure::choose(adjustment, layout);
        let unknowns = structure.as_ref().map_or(layout.unknowns, |structure| structure.order);
        if unknowns > LARGEST {
            return Err(Error::TooLarge { unknowns, limit: LARGEST });
        }
        Ok(match structure {
            Some(structure) => Self::Eliminated(Box::new(BlockNormal::new(layout, structure))),
            None => Self::Dense(NormalEquations::new(layout.unknowns)),
        })
    }

    pub(crate) fn structure(&self) -> Option<&Structure> {
        match self {
            Self::Dense(_) => None,
            Self::Eliminated(normal) => Some(&normal.structure),
        }
    }

    pub(crate) fn accumulate(&mut self, layout: &Layout, linearisation: &Linearisation) {
        match self {
            Self::Dense(normal) => normal.accumulate(layout, linearisation),
            Self::Eliminated(normal) => normal.accumulate(layout, linearisation),
        }
    }

    /// `AᵀPv`.
    pub(crate) fn gradient(&self) -> &[f64] {
        match self {
            Self::Dense(normal) => &normal.gradient,
            Self::Eliminated(normal) => &normal.gradient,
        }
    }

    /// What makes the diagonal one: `dx = scale · y`.
    pub(crate) fn scale(&self) -> Vec<f64> {
        match self {
            Self::Dense(normal) => normal.scale(),
            Self::Eliminated(normal) => unit_scale(&normal.diagonal),
        }
    }

    /// `damping` are λ and the scale that the damping is measured in.
    pub(crate) fn factor(
        &self,
        constraints: &Constraints,
        damping: Option<(f64, &[f64])>,
    ) -> std::result::Result<SystemFactor, Singular> {
        Ok(match self {
            Self::Dense(normal) => SystemFactor::Dense(Box::new(NormalFactor::new(normal, constraints, damping)?)),
            Self::Eliminated(normal) => {
                SystemFactor::Eliminated(Box::new(EliminatedFactor::new(normal, constraints, damping)?))
            }
        })
    }
}

impl SystemFactor {
    /// The step that follows `gradient` and takes away `share` of what the constraints miss.
    pub(crate) fn solve(&self, gradient: &[f64], share: f64) -> Vec<f64> {
        match self {
            Self::Dense(factor) => factor.solve(gradient, share),
            Self::Eliminated(factor) => factor.solve(gradient, share),
        }
    }

    /// Refuses inner constraints in directions that the observations already determine.
    pub(crate) fn check_datum(&self) -> Result<()> {
        match self {
            Self::Dense(factor) => factor.check_datum(),
            Self::Eliminated(factor) => factor.check_datum(),
        }
    }

    /// Solves with the equilibrated matrix alone, in scaled unknowns.
    fn solve_scaled(&self, right: &mut [f64]) {
        match self {
            Self::Dense(factor) => factor.solve_scaled(right),
            Self::Eliminated(factor) => {
                right.iter_mut().zip(&factor.scale).for_each(|(value, s)| *value /= s);
                factor.solve_columns(right);
                right.iter_mut().zip(&factor.scale).for_each(|(value, s)| *value /= s);
            }
        }
    }

    fn norm(&self, system: &System) -> f64 {
        match (self, system) {
            (Self::Dense(factor), System::Dense(normal)) => factor.norm(normal),
            (Self::Eliminated(factor), System::Eliminated(normal)) => factor.norm(normal),
            _ => f64::INFINITY,
        }
    }

    /// Estimate of the condition of the equilibrated matrix in the 1-norm [Higham1988].
    pub(crate) fn condition(&self, system: &System) -> f64 {
        let n = system.gradient().len();
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
        self.norm(system) * estimate.max(other)
    }
}
