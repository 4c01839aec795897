use std::collections::BTreeSet;

use crate::testing::outlier::check_probability;
use crate::{Adjustment, Error, GroupId, Kernel, Method, ObservationId, Result, SnoopingTest, Solution, SolveOptions};

/// How gross errors are sought and rejected.
#[derive(Debug, Clone, PartialEq)]
pub struct SnoopingOptions {
    /// The test. Default: [`SnoopingTest::Baarda`].
    pub test: SnoopingTest,
    /// Significance level of a single test. Default: 0.001.
    pub level: f64,
    /// Most components that may be rejected; `None`, the default: a tenth of those tested, at least one.
    pub max_rejections: Option<usize>,
    /// Most components rejected from one solution before it is computed anew. Within a batch all is as if they were
    /// rejected one at a time in the linearised model; 1 solves after each. Default: 256.
    pub batch: usize,
    /// Components whose errors show with less than this share are never rejected. Default: 0.01.
    pub smallest_control: f64,
    /// Groups that are tested; `None`, the default: all but priors. Groups with a robust kernel look after their errors
    /// themselves and are not tested.
    pub groups: Option<Vec<GroupId>>,
}

impl Default for SnoopingOptions {
    fn default() -> Self {
        Self {
            test: SnoopingTest::default(),
            level: 0.001,
            max_rejections: None,
            batch: 256,
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
        let limit = snooping.max_rejections.unwrap_or((tested.iter().filter(|&&tested| tested).count() / 10).max(1));
        let mut solution = self.solve(options)?;
        search.solutions = 1;
        loop {
            let room = limit.saturating_sub(search.out.len()).min(snooping.batch);
            let batch = solution.batch(&tested, snooping, room.max(1), search.solutions - 1);
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
        let fitting: Vec<Rejection> = self
            .predictions(solution, &out, snooping)?
            .into_iter()
            .filter(|fit| fit.statistic.abs() <= fit.critical)
            .collect();
        for record in &fitting {
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
