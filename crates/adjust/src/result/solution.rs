use std::ops::Range;
use std::sync::OnceLock;

use nalgebra::{DMatrix, Isometry3};

use crate::cofactors::cofactor::Cofactor;
use crate::cofactors::images::Images;
use crate::descent::iteration::Iteration;
use crate::equations::system::LARGEST;
use crate::linearised::layout::{HELD, Layout};
use crate::linearised::linearisation::Linearisation;
use crate::{
    Adjustment, BlockId, Error, GroupId, ObservationId, ParameterBlock, Result, RigidPose, SolveOptions, TraceEntry,
};

/// Which variance factor a covariance or standard deviation is scaled by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// One: the covariances of the observations are taken as they were given.
    Prior,
    /// σ̂₀² = vᵀPv / redundancy, estimated from the residuals.
    Posterior,
}

/// The adjusted parameters and how well they are known. A solution exists only where the iteration converged undamped
/// and all unknowns are determined.
#[derive(Debug, Clone)]
pub struct Solution {
    pub(crate) blocks: Vec<ParameterBlock>,
    pub(crate) groups: Vec<String>,
    pub(crate) group_of: Vec<GroupId>,
    pub(crate) whitening: Vec<f64>,
    pub(crate) whitening_start: Vec<usize>,
    /// Whether each row is excluded; empty where none is.
    excluded: Vec<bool>,
    pub(crate) layout: Layout,
    values: Vec<f64>,
    pub(crate) linearisation: Linearisation,
    pub(crate) names: Vec<String>,
    pub(crate) cofactor: Cofactor,
    /// Made when it is first asked for.
    pub(crate) images: OnceLock<Images>,
    redundancy: i64,
    trace: Vec<TraceEntry>,
}

impl Adjustment<'_> {
    /// Estimates the parameters by least squares, `vᵀPv → min`.
    ///
    /// # Errors
    /// [`Error::RankDeficient`] names what is not determined; [`Error::NotConverged`] where the iteration found no end;
    /// [`Error::Evaluation`] and [`Error::NotFinite`] name an observation whose model has no value at the start;
    /// [`Error::DatumOverdetermined`], [`Error::Datum`] and [`Error::DependentConstraint`] speak of the constraints;
    /// [`Error::Jacobian`] names a wrong derivative where one can be why there is no end or a defect.
    pub fn solve(&self, options: &SolveOptions) -> Result<Solution> {
        options.check()?;
        self.solve_unchecked(options).map_err(|error| self.blame(error))
    }

    fn solve_unchecked(&self, options: &SolveOptions) -> Result<Solution> {
        let layout = Layout::new(self)?;
        let names = self.unknown_names(&layout);
        let mut iteration = Iteration::new(self, &layout, options)?;
        if let Err(error) = iteration.run() {
            iteration.renew()?;
            // A descent that finds no end often has none: an undetermined direction is then the better answer.
            let Error::NotConverged { iterations, reason, objective, step, damping, .. } = error else {
                return Err(error);
            };
            // What ran away is undetermined where it ended, but that is not why.
            let vanished = iteration.vanished()?;
            if vanished.is_none() && iteration.problem().factorise()?.is_none() {
                return Err(iteration.problem().defect(&names)?);
            }
            let parameter = vanished.or_else(|| iteration.unsettled()).map(|unknown| names[unknown].clone());
            let parameter = parameter.unwrap_or_default();
            return Err(Error::NotConverged { iterations, reason, objective, step, damping, parameter });
        }
        let cofactor = iteration.problem().cofactor(&names)?;
        let (values, linearisation, trace) = (iteration.values, iteration.current, iteration.trace);
        let constraints = iteration.constraints.count;
        Ok(self.solution(layout, names, values, linearisation, cofactor, constraints, trace))
    }

    #[allow(clippy::too_many_arguments)] // the parts of one struct
    fn solution(
        &self,
        layout: Layout,
        names: Vec<String>,
        values: Vec<f64>,
        linearisation: Linearisation,
        cofactor: Cofactor,
        constraints: usize,
        trace: Vec<TraceEntry>,
    ) -> Solution {
        Solution {
            blocks: self.blocks.clone(),
            groups: self.groups.iter().map(|group| group.name.clone()).collect(),
            group_of: self.observations.iter().map(|stored| stored.group).collect(),
            whitening: self.whitening.clone(),
            whitening_start: self.observations.iter().map(|stored| stored.whitening).collect(),
            excluded: self.excluded_rows(&layout),
            redundancy: (layout.rows + constraints) as i64 - (layout.unknowns + self.excluded_components()) as i64,
            layout,
            values,
            linearisation,
            names,
            cofactor,
            images: OnceLock::new(),
            trace,
        }
    }

    fn excluded_rows(&self, layout: &Layout) -> Vec<bool> {
        let mut rows = vec![false; if self.exclusions.is_empty() { 0 } else { layout.rows }];
        for (&index, exclusion) in &self.exclusions {
            rows[layout.observations[index].rows()].copy_from_slice(&exclusion.mask);
        }
        rows
    }

    fn unknown_names(&self, layout: &Layout) -> Vec<String> {
        let mut names = Vec::with_capacity(layout.unknowns);
        for (index, block) in self.blocks.iter().enumerate() {
            for (component, &column) in layout.block_columns(index).iter().enumerate() {
                if column != HELD {
                    names.push(block.parameter_name(index, component));
                }
            }
        }
        names
    }
}

impl Adjustment<'_> {
    /// Takes the adjusted values of a solution as approximate values, for a solution nearby.
    pub fn start_from(&mut self, solution: &Solution) -> Result<()> {
        for index in 0..self.blocks.len() {
            let block = BlockId::new(index);
            self.set_values(block, solution.values(block)?)?;
        }
        Ok(())
    }
}

impl AsRef<[ParameterBlock]> for Solution {
    fn as_ref(&self) -> &[ParameterBlock] {
        &self.blocks
    }
}

impl Solution {
    /// Adjusted (or held) values of a block, ambient.
    pub fn values(&self, block: BlockId) -> Result<&[f64]> {
        self.check_block(block)?;
        Ok(&self.values[self.layout.block_values(block.index())])
    }

    /// Adjusted pose of a [`RigidPose`] block.
    pub fn pose(&self, block: BlockId) -> Result<Isometry3<f64>> {
        let values = self.values(block)?;
        let what = format!("block `{}`, taken as a pose,", self.blocks[block.index()].label(block.index()));
        RigidPose::isometry(values).map_err(|_| Error::Length { what, expected: 7, found: values.len() })
    }

    /// Covariance matrix of a block's tangent step; zero where a parameter was held.
    pub fn covariance(&self, block: BlockId, scale: Scale) -> Result<DMatrix<f64>> {
        self.covariance_between(block, block, scale)
    }

    /// Covariance matrix between the tangent steps of two blocks (rows: `first`).
    pub fn covariance_between(&self, first: BlockId, second: BlockId, scale: Scale) -> Result<DMatrix<f64>> {
        self.check_block(first)?;
        self.check_block(second)?;
        let factor = self.variance_factor(scale)?;
        let free = self.cofactor.block(&self.layout, first.index(), second.index()) * factor;
        let (rows, columns) = (self.layout.block_columns(first.index()), self.layout.block_columns(second.index()));
        if free.shape() == (rows.len(), columns.len()) {
            return Ok(free);
        }
        let (top, left) = (self.layout.free(first.index()).start, self.layout.free(second.index()).start);
        Ok(DMatrix::from_fn(rows.len(), columns.len(), |i, j| match (rows[i], columns[j]) {
            (HELD, _) | (_, HELD) => 0.0,
            (row, column) => free[(row - top, column - left)],
        }))
    }

    /// Standard deviations of a block's parameters (tangent step); zero where a parameter was held.
    pub fn standard_deviations(&self, block: BlockId, scale: Scale) -> Result<Vec<f64>> {
        Ok(self.covariance(block, scale)?.diagonal().iter().map(|variance| variance.max(0.0).sqrt()).collect())
    }

    /// Covariance matrix of all unknowns, in the order of [`Self::unknown_names`].
    ///
    /// # Errors
    /// [`Error::TooLarge`] beyond 15,000 unknowns, where it would take more than 1.8 GB: ask for
    /// [`Self::covariance`] and [`Self::covariance_between`]. [`Error::NoRedundancy`] for the posterior scale.
    pub fn covariance_matrix(&self, scale: Scale) -> Result<DMatrix<f64>> {
        let factor = self.variance_factor(scale)?;
        let n = self.layout.unknowns;
        if n > LARGEST {
            return Err(Error::TooLarge { unknowns: n, limit: LARGEST });
        }
        let mut out = DMatrix::zeros(n, n);
        for second in 0..self.layout.blocks() {
            for first in second..self.layout.blocks() {
                let block = self.cofactor.block(&self.layout, first, second) * factor;
                let place = (self.layout.free(first).start, self.layout.free(second).start);
                out.view_mut(place, block.shape()).copy_from(&block);
                out.view_mut((place.1, place.0), (block.ncols(), block.nrows())).copy_from(&block.transpose());
            }
        }
        Ok(out)
    }

    /// Correlation matrix of all unknowns; empty beyond 15,000 unknowns, where [`Self::covariance_matrix`] is an error.
    pub fn correlation_matrix(&self) -> DMatrix<f64> {
        let Ok(mut out) = self.covariance_matrix(Scale::Prior) else { return DMatrix::zeros(0, 0) };
        let deviations: Vec<f64> = out.diagonal().iter().map(|variance| variance.sqrt()).collect();
        for (mut column, own) in out.column_iter_mut().zip(&deviations) {
            column.iter_mut().zip(&deviations).for_each(|(q, other)| *q /= own * other);
        }
        out
    }

    /// Correlation between two single parameters, each a block and a component of its tangent step.
    /// NaN where one of them is held or fixed by constraints.
    pub fn correlation(&self, first: (BlockId, usize), second: (BlockId, usize)) -> Result<f64> {
        match (self.column(first)?, self.column(second)?) {
            (HELD, _) | (_, HELD) => Ok(f64::NAN),
            (row, column) => Ok(self.correlation_of(row, column)),
        }
    }

    /// Names of the unknowns, in the order of their columns: block by block in the order of adding, held parameters
    /// left out.
    pub fn unknown_names(&self) -> &[String] {
        &self.names
    }

    /// Column of a parameter among the unknowns; `None` where it is held.
    pub fn unknown_index(&self, block: BlockId, component: usize) -> Result<Option<usize>> {
        Ok(Some(self.column((block, component))?).filter(|&column| column != HELD))
    }

    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.layout.unknowns
    }

    /// Whether an observed value (by its place in [`Self::residuals`]) was left out, see [`Adjustment::exclude`].
    pub fn is_excluded(&self, row: usize) -> bool {
        self.excluded.get(row).copied().unwrap_or(false)
    }

    /// Number of observed values, components of priors and excluded ones included.
    pub fn observations(&self) -> usize {
        self.layout.rows
    }

    /// Observations that are not excluded + constraints (datum included) − unknowns.
    pub fn redundancy(&self) -> i64 {
        self.redundancy
    }

    /// Weighted sum of squared residuals; robust weights are part of it.
    pub fn vtpv(&self) -> f64 {
        self.linearisation.vtpv
    }

    /// Posterior standard deviation of unit weight, `√(vᵀPv / redundancy)`; `None` without redundancy.
    pub fn sigma0(&self) -> Option<f64> {
        (self.redundancy > 0).then(|| (self.vtpv() / self.redundancy as f64).sqrt())
    }

    /// Iterations taken.
    pub fn iterations(&self) -> usize {
        self.trace.len()
    }

    /// What each iteration did.
    pub fn trace(&self) -> &[TraceEntry] {
        &self.trace
    }

    /// All residuals v = observed − model, in the order of adding.
    pub fn residuals(&self) -> &[f64] {
        &self.linearisation.residual
    }

    /// Robust weights of all observed values, in the same order: 1 for least squares, towards 0 for what a [`crate::Kernel`]
    /// takes for a gross error and for what is excluded.
    pub fn weights(&self) -> &[f64] {
        &self.linearisation.weights
    }

    /// Residuals of one observation.
    pub fn residual(&self, observation: ObservationId) -> Result<&[f64]> {
        Ok(&self.linearisation.residual[self.rows(observation)?])
    }

    /// Where the components of an observation lie in [`Self::residuals`] and the other lists over all observations.
    pub fn rows(&self, observation: ObservationId) -> Result<Range<usize>> {
        let count = self.layout.observations.len();
        let place = self.layout.observations.get(observation.0);
        Ok(place.ok_or(Error::UnknownId { what: "observation", index: observation.0, count })?.rows())
    }

    /// Row of one component of an observation.
    pub(crate) fn row(&self, observation: ObservationId, component: usize) -> Result<usize> {
        let rows = self.rows(observation)?;
        let unknown = Error::UnknownId { what: "component", index: component, count: rows.len() };
        if component < rows.len() { Ok(rows.start + component) } else { Err(unknown) }
    }

    pub(crate) fn block_label(&self, block: BlockId) -> String {
        self.blocks
            .get(block.index())
            .map_or_else(|| format!("block {}", block.index()), |known| known.label(block.index()))
    }

    pub(crate) fn parameter_name(&self, (block, component): (BlockId, usize)) -> String {
        let known = self.blocks.get(block.index()).map(|known| known.parameter_name(block.index(), component));
        known.unwrap_or_else(|| format!("block {}", block.index()))
    }

    /// The tangent step from `reference` (ambient) to the adjusted values of a block.
    pub(crate) fn difference(&self, block: BlockId, reference: &[f64]) -> Result<Vec<f64>> {
        let values = self.values(block)?;
        let known = &self.blocks[block.index()];
        known.check(block.index(), reference)?;
        let mut out = vec![0.0; known.tangent_dimension()];
        known.manifold.minus(values, reference, &mut out);
        Ok(out)
    }

    /// Number of components of a block's tangent step, held ones included.
    pub(crate) fn tangent_dimension(&self, block: BlockId) -> Result<usize> {
        self.check_block(block)?;
        Ok(self.layout.block_columns(block.index()).len())
    }

    pub(crate) fn cofactor(&self, row: usize, column: usize) -> f64 {
        self.cofactor.element(&self.layout, row, column)
    }

    pub(crate) fn correlation_of(&self, row: usize, column: usize) -> f64 {
        self.cofactor(row, column) / (self.cofactor(row, row) * self.cofactor(column, column)).sqrt()
    }

    pub(crate) fn variance_factor(&self, scale: Scale) -> Result<f64> {
        match scale {
            Scale::Prior => Ok(1.0),
            Scale::Posterior => {
                let sigma0 = self.sigma0().ok_or(Error::NoRedundancy { redundancy: self.redundancy })?;
                Ok(sigma0 * sigma0)
            }
        }
    }

    fn column(&self, (block, component): (BlockId, usize)) -> Result<usize> {
        self.check_block(block)?;
        let columns = self.layout.block_columns(block.index());
        let count = columns.len();
        columns.get(component).copied().ok_or(Error::UnknownId { what: "parameter", index: component, count })
    }

    fn check_block(&self, block: BlockId) -> Result<()> {
        let count = self.blocks.len();
        if block.index() < count {
            Ok(())
        } else {
            Err(Error::UnknownId { what: "block", index: block.index(), count })
        }
    }
}
