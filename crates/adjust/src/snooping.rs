use std::collections::BTreeSet;

use nalgebra::DMatrix;

use crate::outlier::{Control, check_probability};
use crate::readmission::Fit;
use crate::{
    Adjustment, BlockId, Error, GroupId, Kernel, Method, ObservationId, Result, Scale, SnoopingTest, Solution,
    SolveOptions,
};

/// How gross errors are sought and rejected.
#[derive(Debug, Clone, PartialEq)]
pub struct SnoopingOptions {
    /// The test.
    pub test: SnoopingTest,
    /// Significance level of a single test.
    pub level: f64,
    /// Most components that may be rejected; `None`: a tenth of those tested.
    pub max_rejections: Option<usize>,
    /// Most components rejected from one solution before it is computed anew. Within a batch all is as if they were
    /// rejected one at a time in the linearised model; 1 solves after each.
    pub batch: usize,
    /// Components whose errors show with less than this share are never rejected.
    pub smallest_control: f64,
    /// Groups that are tested; `None`: all but priors. Groups with a robust kernel look after their errors themselves
    /// and are not tested.
    pub groups: Option<Vec<GroupId>>,
}

impl Default for SnoopingOptions {
    fn default() -> Self {
        Self {
            test: SnoopingTest::default(),
            level: 0.001,
            max_rejections: None,
            batch: 64,
            smallest_control: 0.01,
            groups: None,
        }
    }
}

/// One decision of the test: a component rejected or taken back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rejection {
    /// Observation.
    pub observation: ObservationId,
    /// Its component.
    pub component: usize,
    /// w or τ after those before it in the same step were rejected. For one taken back: its prediction error over the
    /// standard deviation of that (w, or Student's t).
    pub statistic: f64,
    /// Critical value of the statistic.
    pub critical: f64,
    /// Residual in the solution of the decision, unit of the observation.
    pub residual: f64,
    /// Share of its errors that showed in the solution of the decision: the redundancy number where it is not correlated
    /// within its observation. For one taken back, that which it will have.
    pub redundancy_number: f64,
    /// Number of the solution that the decision is based on, from 0.
    pub step: usize,
}

/// How the search for gross errors ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SnoopingEnd {
    /// Nothing that is used exceeds the critical value, except what is hardly controlled.
    Clean,
    /// The largest number of rejections was reached and more are conspicuous: the model, the standard deviations or the
    /// start values deserve a doubt.
    LimitReached,
}

/// A solution without the gross errors that the test found.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct SnoopedSolution {
    /// The solution; rejected components are excluded in it and in the adjustment.
    pub solution: Solution,
    /// What is rejected in the end, in the order of rejection.
    pub rejected: Vec<Rejection>,
    /// What was rejected, but fitted after others were gone and is used again.
    pub readmitted: Vec<Rejection>,
    /// Number of solutions computed.
    pub solutions: usize,
    /// How the search ended.
    pub end: SnoopingEnd,
}

impl Adjustment<'_> {
    /// Solves, rejects the components that fail the test for gross errors, the largest first, and solves again from
    /// there until none is left; then what was rejected and fits again is taken back, and the rest tested once more.
    /// A component rejected twice stays out. Each is excluded by itself ([`Self::exclude`]); what was excluded before
    /// stays so. The solution's values become the approximate values.
    ///
    /// Several components are rejected from one solution: removing one changes pull and variance of all others by an
    /// exact formula of the linear model (a Schur complement of `P Q_vv P`), so that each is judged as if those before
    /// it were gone already; a component that a larger one has pulled off is thus not rejected with it.
    ///
    /// # Errors
    /// Those of [`Self::solve`], then nothing is excluded that was not before; [`Error::Option`] for options outside
    /// their domain.
    pub fn solve_snooping(&mut self, options: &SolveOptions, snooping: &SnoopingOptions) -> Result<SnoopedSolution> {
        snooping.check(self)?;
        let mut search = Search::default();
        let done = self.search(options, snooping, &mut search);
        if done.is_err() {
            for &(observation, component) in &search.out {
                self.readmit(observation, component)?;
            }
        }
        let (solution, end) = done?;
        let Search { mut rejected, readmitted, out, solutions, .. } = search;
        rejected.retain(|r| out.contains(&(r.observation, r.component)));
        // One that came back and was rejected again is listed with its last rejection.
        let mut seen = BTreeSet::new();
        rejected.reverse();
        rejected.retain(|r| seen.insert((r.observation, r.component)));
        rejected.reverse();
        Ok(SnoopedSolution { solution, rejected, readmitted, solutions, end })
    }

    fn search(
        &mut self,
        options: &SolveOptions,
        snooping: &SnoopingOptions,
        search: &mut Search,
    ) -> Result<(Solution, SnoopingEnd)> {
        let tested = self.tested_rows(snooping);
        let limit = snooping.max_rejections.unwrap_or(tested.iter().filter(|&&tested| tested).count() / 10);
        let mut solution = self.solve(options)?;
        search.solutions = 1;
        loop {
            let room = limit.saturating_sub(search.out.len()).min(snooping.batch);
            let batch = solution.batch(&tested, snooping, room.max(1), search.solutions - 1)?;
            if !batch.is_empty() && room == 0 {
                return Ok((solution, SnoopingEnd::LimitReached));
            }
            let changed = if batch.is_empty() {
                self.take_back(&solution, snooping, search)?
            } else {
                self.reject(batch, search)?;
                true
            };
            if !changed {
                return Ok((solution, SnoopingEnd::Clean));
            }
            solution = self.resolve(&solution, options)?;
            search.solutions += 1;
        }
    }

    fn reject(&mut self, batch: Vec<Rejection>, search: &mut Search) -> Result<()> {
        for rejection in batch {
            self.exclude(rejection.observation, rejection.component)?;
            search.out.insert((rejection.observation, rejection.component));
            search.rejected.push(rejection);
        }
        Ok(())
    }

    /// Takes back what fits, each component once. True where there was any.
    fn take_back(&mut self, solution: &Solution, snooping: &SnoopingOptions, search: &mut Search) -> Result<bool> {
        let out: Vec<_> = search.out.iter().copied().filter(|one| !search.returned.contains(one)).collect();
        let fitting: Vec<Fit> = self
            .predictions(solution, &out, snooping)?
            .into_iter()
            .filter(|fit| fit.record.statistic.abs() <= fit.record.critical)
            .collect();
        for Fit { record } in &fitting {
            let component = (record.observation, record.component);
            self.readmit(record.observation, record.component)?;
            search.out.remove(&component);
            search.returned.insert(component);
            search.readmitted.push(Rejection { step: search.solutions - 1, ..*record });
        }
        Ok(!fitting.is_empty())
    }

    /// Solves from the solution of a nearly equal problem.
    pub(crate) fn resolve(&mut self, last: &Solution, options: &SolveOptions) -> Result<Solution> {
        self.start_from(last)?;
        match self.solve(&SolveOptions { method: Method::GaussNewton, ..options.clone() }) {
            Err(Error::NotConverged { .. }) => self.solve(options),
            done => done,
        }
    }

    fn tested_rows(&self, snooping: &SnoopingOptions) -> Vec<bool> {
        let prior = self.existing_prior_group();
        let mut rows = Vec::new();
        for stored in &self.observations {
            let asked = match &snooping.groups {
                Some(groups) => groups.contains(&stored.group),
                None => Some(stored.group) != prior,
            };
            let plain = self.groups[stored.group.0].kernel == Kernel::LeastSquares;
            rows.resize(rows.len() + stored.observation.dimension(), asked && plain);
        }
        rows
    }
}

/// What a search has done so far.
#[derive(Debug, Default)]
struct Search {
    /// Components excluded by it.
    out: BTreeSet<(ObservationId, usize)>,
    /// Components taken back once.
    returned: BTreeSet<(ObservationId, usize)>,
    rejected: Vec<Rejection>,
    readmitted: Vec<Rejection>,
    solutions: usize,
}

impl SnoopingOptions {
    fn check(&self, adjustment: &Adjustment<'_>) -> Result<()> {
        check_probability("level", self.level)?;
        if !(self.smallest_control > 0.0 && self.smallest_control < 1.0) {
            let (name, value) = ("smallest_control", self.smallest_control);
            return Err(Error::Option { name, value, expected: "a share between 0 and 1" });
        }
        if self.batch == 0 {
            return Err(Error::Option { name: "batch", value: 0.0, expected: "at least 1" });
        }
        let count = adjustment.groups.len();
        match self.groups.iter().flatten().find(|group| group.0 >= count) {
            Some(group) => Err(Error::UnknownId { what: "group", index: group.0, count }),
            None => Ok(()),
        }
    }
}

impl Solution {
    /// The components to be rejected from this solution, at most `room`.
    fn batch(&self, tested: &[bool], snooping: &SnoopingOptions, room: usize, step: usize) -> Result<Vec<Rejection>> {
        let controls = self.controls();
        let testable =
            |&row: &usize| tested[row] && !self.is_excluded(row) && controls[row].share() > snooping.smallest_control;
        let size = |row: usize| controls[row].statistic().abs();
        let mut rows: Vec<usize> = (0..controls.len()).filter(testable).collect();
        rows.sort_by(|&a, &b| size(b).total_cmp(&size(a)));
        // Twice as many as may be rejected: the largest need not be the guilty.
        rows.truncate(2 * room);
        let critical = snooping.test.critical(snooping.level, self.vtpv(), self.redundancy() as f64);
        let conspicuous = rows.first().is_some_and(|&row| size(row) > critical.value * critical.sigma0);
        if !conspicuous {
            return Ok(Vec::new());
        }
        if snooping.batch == 1 {
            rows.truncate(1);
        }
        let mut sweep = Sweep::new(self, &rows, &controls)?;
        let mut batch = Vec::new();
        while batch.len() < room {
            let critical = snooping.test.critical(snooping.level, sweep.vtpv, sweep.redundancy);
            let Some((index, w)) = sweep.largest(&rows, &controls, snooping.smallest_control) else { break };
            let statistic = w / critical.sigma0;
            if statistic.is_nan() || critical.value.is_nan() || statistic.abs() <= critical.value {
                break;
            }
            let row = rows[index];
            let observation = self.observation_of(row).unwrap_or_default();
            batch.push(Rejection {
                observation: ObservationId(observation),
                component: row - self.layout.observations[observation].row,
                statistic,
                critical: critical.value,
                residual: self.residuals()[row],
                redundancy_number: controls[row].share(),
                step,
            });
            sweep.remove(index);
        }
        Ok(batch)
    }

    /// `P Q_vv P` among some rows.
    fn mutual_information(&self, rows: &[usize], controls: &[Control]) -> Result<DMatrix<f64>> {
        let owners = self.owners();
        let designs: Vec<_> = rows.iter().map(|&row| self.weighted_design(row, &owners)).collect();
        let mut blocks: Vec<BlockId> = designs.iter().flat_map(crate::joint::WeightedDesign::blocks).collect();
        blocks.sort_unstable();
        blocks.dedup();
        let offsets = self.offsets(&blocks)?;
        let columns: Vec<_> = designs.iter().map(|design| design.over(&blocks, &offsets)).collect();
        let size = offsets[blocks.len()];
        let design = DMatrix::from_fn(size, rows.len(), |row, column| columns[column][row]);
        let mut out = -(design.transpose() * self.covariance_of(&blocks, Scale::Prior)? * design);
        for (i, &first) in rows.iter().enumerate() {
            for (j, &second) in rows.iter().enumerate() {
                out[(i, j)] += self.weight_between(first, second);
            }
            // The same number as in the test itself, to the last bit.
            out[(i, i)] = controls[first].information;
        }
        Ok(out)
    }

    /// Element of P.
    fn weight_between(&self, first: usize, second: usize) -> f64 {
        let (Some(observation), Some(other)) = (self.observation_of(first), self.observation_of(second)) else {
            return 0.0;
        };
        if observation != other {
            return 0.0;
        }
        let place = &self.layout.observations[observation];
        let whitening = &self.whitening[self.whitening_start[observation]..];
        let element = |row: usize, column: usize| whitening[row * (row + 1) / 2 + column];
        let (a, b) = (first - place.row, second - place.row);
        (a.max(b)..place.dimension).map(|i| element(i, a) * element(i, b)).sum()
    }
}

/// Pulls and information of some components, while one after the other is removed.
struct Sweep {
    pulls: Vec<f64>,
    information: DMatrix<f64>,
    removed: Vec<bool>,
    vtpv: f64,
    redundancy: f64,
}

impl Sweep {
    fn new(solution: &Solution, rows: &[usize], controls: &[Control]) -> Result<Self> {
        Ok(Self {
            pulls: rows.iter().map(|&row| controls[row].pull).collect(),
            information: solution.mutual_information(rows, controls)?,
            removed: vec![false; rows.len()],
            vtpv: solution.vtpv(),
            redundancy: solution.redundancy() as f64,
        })
    }

    /// The component with the largest w among those that are still controlled, and its w.
    fn largest(&self, rows: &[usize], controls: &[Control], smallest: f64) -> Option<(usize, f64)> {
        let mut best: Option<(usize, f64)> = None;
        for (index, &row) in rows.iter().enumerate() {
            let information = self.information[(index, index)];
            if self.removed[index] || information <= smallest * controls[row].weight {
                continue;
            }
            let w = self.pulls[index] / information.sqrt();
            if best.is_none_or(|(_, largest)| w.abs() > largest.abs()) {
                best = Some((index, w));
            }
        }
        best
    }

    /// Gives the component an unknown error of its own, which is the same as removing it.
    fn remove(&mut self, index: usize) {
        self.removed[index] = true;
        let own = self.information[(index, index)];
        let column = self.information.column(index).into_owned();
        let pull = self.pulls[index];
        for (pull_of, shared) in self.pulls.iter_mut().zip(column.iter()) {
            *pull_of -= shared * pull / own;
        }
        self.information -= &column * column.transpose() / own;
        self.vtpv -= pull * pull / own;
        self.redundancy -= 1.0;
    }
}
