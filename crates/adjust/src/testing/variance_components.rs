use nalgebra::DMatrix;

use crate::{Adjustment, Error, GroupId, Result, Scale, Solution, SolveOptions};

/// Unknowns up to which the deviations of the components are computed with all products of the normal equations.
const LARGEST_RIGOROUS: usize = 1200;
/// Factors beyond this, or below its inverse, say that a group fits exactly or that the model is wrong.
const LARGEST_FACTOR: f64 = 1e10;
/// Largest change of a factor in one iteration.
const LARGEST_CHANGE: f64 = 1e4;

/// How variance components are estimated.
#[derive(Debug, Clone, PartialEq)]
pub struct VarianceComponentOptions {
    /// Most iterations, each one solution. Default: 100.
    pub max_iterations: usize,
    /// The iteration ends when no factor changes by more than this share. Default: 1e-4.
    pub tolerance: f64,
    /// Groups with less redundancy are held: their residuals say next to nothing about their variance. Default: 3.
    pub smallest_redundancy: f64,
}

impl Default for VarianceComponentOptions {
    fn default() -> Self {
        Self { max_iterations: 100, tolerance: 1e-4, smallest_redundancy: 3.0 }
    }
}

/// What became of a group.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ComponentStatus {
    /// Its variance was estimated.
    Estimated,
    /// It has too little redundancy; its covariances stay as they were given.
    Held,
    /// Its factor ran towards zero or infinity (a group that fits exactly, or a wrong model); it is held where it left
    /// the range of 1e-10 to 1e10.
    OutOfRange,
}

/// The variance component of one group.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct VarianceComponent {
    /// Group.
    pub group: GroupId,
    /// Its name.
    pub name: String,
    /// The factor of its covariance matrices: 4 where its standard deviations were stated half as large as they are.
    pub factor: f64,
    /// Standard deviation of the factor; zero where it is held.
    pub deviation: f64,
    /// Redundancy of the group in the final solution.
    pub redundancy: f64,
    /// What became of it.
    pub status: ComponentStatus,
}

/// How far the deviations of variance components go.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ComponentPrecision {
    /// From the information matrix of all components, their correlations included.
    Rigorous,
    /// `factor · √(2 / redundancy)`, as if the groups shared no redundancy (more than 1200 unknowns): a little too small.
    Simplified,
}

/// Estimated variance components and the solution with them.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct VarianceComponents {
    /// One for each group asked for, in that order.
    pub components: Vec<VarianceComponent>,
    /// Iterations, each one solution.
    pub iterations: usize,
    /// Whether the factors came to rest. Where they did not, the components are no estimates.
    pub converged: bool,
    /// What the deviations contain.
    pub precision: ComponentPrecision,
    /// Solution with the scaled covariances.
    pub solution: Solution,
}

impl Adjustment<'_> {
    /// Estimates by how much the covariances of each of the groups are mis-stated, relative to those of all others:
    /// Förstner's iteration `σᵢ² ← σᵢ² vᵢᵀPᵢvᵢ / rᵢ`, whose fixed point is that of restricted maximum likelihood and of
    /// Helmert's rigorous estimator \[Foerstner1979\]. The covariances of the groups are scaled in the adjustment, and the
    /// solution's values become its approximate values.
    ///
    /// The groups not named keep the covariances given, and so does the whole where none is named: with all groups named
    /// the posterior variance factor is one in the end. Gross errors should be rejected before.
    ///
    /// # Errors
    /// Those of [`Self::solve`], a group unknown or named twice, or options outside their domain: then nothing is scaled.
    pub fn estimate_variance_components(
        &mut self,
        groups: &[GroupId],
        options: &SolveOptions,
        components: &VarianceComponentOptions,
    ) -> Result<VarianceComponents> {
        components.check()?;
        self.check_groups(groups)?;
        let before = (self.whitening.clone(), self.exclusions.clone());
        let done = self.iterate_components(groups, options, components);
        if done.is_err() {
            (self.whitening, self.exclusions) = before;
        }
        done
    }

    fn iterate_components(
        &mut self,
        groups: &[GroupId],
        options: &SolveOptions,
        limits: &VarianceComponentOptions,
    ) -> Result<VarianceComponents> {
        let count = groups.len();
        let mut state = State { factors: vec![1.0; count], status: vec![ComponentStatus::Estimated; count] };
        let mut solution = self.solve(options)?;
        let (mut iterations, mut converged) = (1, false);
        loop {
            let largest = state.scale(self, groups, &solution.group_figures(), limits)?;
            if largest > 0.0 {
                solution = self.resolve(&solution, options)?;
            }
            converged |= largest <= limits.tolerance;
            if converged || iterations >= limits.max_iterations {
                break;
            }
            iterations += 1;
        }
        let State { factors, status } = state;
        let converged = converged && !status.contains(&ComponentStatus::OutOfRange);
        let (deviations, precision) = solution.component_deviations(groups, &status);
        let figures = solution.group_figures();
        let component = |(index, &group): (usize, &GroupId)| VarianceComponent {
            group,
            name: self.groups[group.0].name.clone(),
            factor: factors[index],
            deviation: factors[index] * deviations[index],
            redundancy: figures[group.0].1,
            status: status[index],
        };
        let components = groups.iter().enumerate().map(component).collect();
        Ok(VarianceComponents { components, iterations, converged, precision, solution })
    }

    fn check_groups(&self, groups: &[GroupId]) -> Result<()> {
        let count = self.groups.len();
        for (index, group) in groups.iter().enumerate() {
            if group.0 >= count {
                return Err(Error::UnknownId { what: "group", index: group.0, count });
            }
            if groups[..index].contains(group) {
                let what = format!("group `{}`", self.groups[group.0].name);
                return Err(Error::Untestable { what, reason: "it is named twice" });
            }
        }
        Ok(())
    }
}

/// Factors on their way.
struct State {
    factors: Vec<f64>,
    status: Vec<ComponentStatus>,
}

impl State {
    /// Scales the groups by what their residuals say; returns the largest relative change.
    fn scale(
        &mut self,
        adjustment: &mut Adjustment<'_>,
        groups: &[GroupId],
        figures: &[(f64, f64)],
        limits: &VarianceComponentOptions,
    ) -> Result<f64> {
        let mut largest = 0.0_f64;
        for (index, &group) in groups.iter().enumerate() {
            if self.status[index] != ComponentStatus::Estimated {
                continue;
            }
            let (vtpv, redundancy) = figures[group.0];
            let share = if redundancy < limits.smallest_redundancy {
                self.status[index] = ComponentStatus::Held;
                1.0 / self.factors[index]
            } else {
                (vtpv / redundancy).clamp(1.0 / LARGEST_CHANGE, LARGEST_CHANGE)
            };
            adjustment.scale_covariance(group, share)?;
            self.factors[index] *= share;
            largest = largest.max((share - 1.0).abs());
            if !(1.0 / LARGEST_FACTOR..=LARGEST_FACTOR).contains(&self.factors[index]) {
                self.status[index] = ComponentStatus::OutOfRange;
            }
        }
        Ok(largest)
    }
}

impl VarianceComponentOptions {
    fn check(&self) -> Result<()> {
        for (name, value) in [("tolerance", self.tolerance), ("smallest_redundancy", self.smallest_redundancy)] {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::Option { name, value, expected: "a positive number" });
            }
        }
        Ok(())
    }
}

impl Solution {
    /// vᵀPv and redundancy of every group.
    fn group_figures(&self) -> Vec<(f64, f64)> {
        let numbers = self.redundancy_numbers();
        let mut out = vec![(0.0, 0.0); self.groups.len()];
        for (place, group) in self.layout.observations.iter().zip(&self.group_of) {
            for row in place.rows() {
                out[group.0].0 += self.weights()[row] * self.linearisation.whitened[row].powi(2);
                out[group.0].1 += numbers[row];
            }
        }
        out
    }

    /// Relative standard deviations of the factors of groups, zero for those not estimated.
    fn component_deviations(&self, groups: &[GroupId], status: &[ComponentStatus]) -> (Vec<f64>, ComponentPrecision) {
        let mut out = vec![0.0; groups.len()];
        let estimated: Vec<usize> = (0..groups.len()).filter(|&i| status[i] == ComponentStatus::Estimated).collect();
        let chosen: Vec<GroupId> = estimated.iter().map(|&i| groups[i]).collect();
        let information = self.component_information(&chosen);
        if let Some(inverse) = information.and_then(DMatrix::try_inverse) {
            for (place, &index) in estimated.iter().enumerate() {
                out[index] = (2.0 * inverse[(place, place)]).sqrt();
            }
            return (out, ComponentPrecision::Rigorous);
        }
        let figures = self.group_figures();
        for &index in &estimated {
            out[index] = (2.0 / figures[groups[index].0].1).sqrt();
        }
        (out, ComponentPrecision::Simplified)
    }

    /// Twice the information of relative variance factors: `Sᵢⱼ = Σ R²` over the rows of i and columns of j, with the
    /// projection `R = I − J Q Jᵀ`; that is `δᵢⱼ (nᵢ − 2 tr Q Nᵢ) + tr(Q Nᵢ Q Nⱼ)`.
    pub(crate) fn component_information(&self, groups: &[GroupId]) -> Option<DMatrix<f64>> {
        if self.unknowns() > LARGEST_RIGOROUS {
            return None;
        }
        let cofactor = self.covariance_matrix(Scale::Prior).ok()?;
        let products: Vec<_> = groups.iter().map(|&group| self.normal_of(group)).collect();
        let products: Vec<_> = products.into_iter().map(|(rows, normal)| (rows, &cofactor * normal)).collect();
        Some(DMatrix::from_fn(groups.len(), groups.len(), |i, j| {
            let ((rows, first), (_, second)) = (&products[i], &products[j]);
            let own = if i == j { *rows as f64 - 2.0 * first.trace() } else { 0.0 };
            own + first.component_mul(&second.transpose()).sum()
        }))
    }

    /// Number of rows of a group that are used, and its part of the normal equations.
    fn normal_of(&self, group: GroupId) -> (usize, DMatrix<f64>) {
        let (mut rows, mut normal) = (0, DMatrix::zeros(self.unknowns(), self.unknowns()));
        let of_group = self.layout.observations.iter().zip(&self.group_of).filter(|(_, of)| **of == group);
        for (place, _) in of_group {
            let columns = self.columns_of(place);
            let jacobian = &self.linearisation.jacobian[place.jacobian_range()];
            for (index, row) in place.rows().enumerate().filter(|&(_, row)| !self.is_excluded(row)) {
                rows += 1;
                let entries = &jacobian[index * columns.len()..(index + 1) * columns.len()];
                for (&a, &column) in entries.iter().zip(&columns) {
                    for (&b, &other) in entries.iter().zip(&columns) {
                        normal[(other, column)] += self.weights()[row] * a * b;
                    }
                }
            }
        }
        (rows, normal)
    }
}
