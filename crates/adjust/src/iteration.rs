use crate::constraints::Constraints;
use crate::layout::Layout;
use crate::linearisation::{Linearisation, Want};
use crate::normal::{NormalEquations, NormalFactor, Singular};
use crate::rank::{Factor, Problem};
use crate::{Adjustment, Error, Method, Result, SolveOptions, StepKind, TraceEntry};

/// Damping beyond which a damped step is no step any more.
const LARGEST_DAMPING: f64 = 1e20;
/// A damped step that is expected to reduce the objective by less than this share ends the descent.
const SMALL_GAIN: f64 = 1e-3;
/// Undamped steps in a row that may fail to become shorter before they count as stagnant.
const STAGNANT: usize = 4;

/// Standard deviations below which a step that rounding keeps alive (it no longer shortens, or the objective no longer
/// falls along it) does no harm: its reduction of the objective is 1e-12 of one observation's share.
const HARMLESS: f64 = 1e-6;

/// The state of one run.
pub(crate) struct Iteration<'p, 'a> {
    adjustment: &'p Adjustment<'a>,
    layout: &'p Layout,
    options: &'p SolveOptions,
    pub(crate) values: Vec<f64>,
    pub(crate) current: Linearisation,
    pub(crate) constraints: Constraints,
    pub(crate) normal: NormalEquations,
    pub(crate) trace: Vec<TraceEntry>,
    trial: Linearisation,
    trial_values: Vec<f64>,
    moved: Vec<f64>,
    /// Weight of the constraints in the merit function (exact penalty: above the largest multiplier).
    penalty: f64,
    damping: f64,
    growth: f64,
    /// Longest column norms met so far, as scale factors: the metric of the damping [More1978].
    metric: Vec<f64>,
}

/// What an undamped step did.
enum Undamped {
    Converged,
    Moved { shortened: bool },
    Blocked,
}

impl<'p, 'a> Iteration<'p, 'a> {
    pub(crate) fn new(adjustment: &'p Adjustment<'a>, layout: &'p Layout, options: &'p SolveOptions) -> Result<Self> {
        let values: Vec<f64> = adjustment.blocks.iter().flat_map(|block| block.values.iter().copied()).collect();
        let mut this = Self {
            adjustment,
            layout,
            options,
            trial_values: values.clone(),
            values,
            current: Linearisation::new(layout),
            constraints: Constraints::default(),
            normal: NormalEquations::new(layout.unknowns),
            trace: Vec::new(),
            trial: Linearisation::new(layout),
            moved: vec![0.0; layout.rows],
            penalty: 0.0,
            damping: options.initial_damping,
            growth: 2.0,
            metric: vec![f64::INFINITY; layout.unknowns],
        };
        this.linearise()?;
        Ok(this)
    }

    fn linearise(&mut self) -> Result<()> {
        self.current.evaluate(self.adjustment, self.layout, &self.values, Want::Jacobians)?;
        self.constraints = Constraints::new(self.adjustment, self.layout, &self.current, &self.values)?;
        self.normal.accumulate(self.layout, &self.current);
        let scale = self.normal.scale();
        self.metric.iter_mut().zip(scale).for_each(|(metric, scale)| *metric = metric.min(scale));
        Ok(())
    }

    /// Runs to the end; the state is then linearised at the solution.
    pub(crate) fn run(&mut self) -> Result<()> {
        if self.layout.unknowns == 0 {
            return Ok(());
        }
        let mut small_gain = SMALL_GAIN;
        let mut damped = self.options.method == Method::LevenbergMarquardt;
        loop {
            let descended = !damped || self.descend(small_gain)?;
            if self.polish(damped && descended)? {
                return Ok(());
            }
            // Undamped steps led nowhere: descend further before they are tried again.
            damped = true;
            small_gain *= 1e-2;
            if !descended || small_gain < 1e-30 || self.options.method == Method::GaussNewton {
                return Err(self.not_converged("neither damped nor undamped steps lead on"));
            }
        }
    }

    /// Damped steps until they promise little. False where no step reduces the objective any more.
    fn descend(&mut self, small_gain: f64) -> Result<bool> {
        loop {
            self.check_budget()?;
            let reference = (self.damping, self.metric.as_slice());
            let factor = match NormalFactor::new(&self.normal, &self.constraints, Some(reference)) {
                Ok(factor) => factor,
                Err(Singular::Constraints(error)) => return Err(error),
                Err(Singular::Normal) => {
                    if !self.raise_damping(f64::NAN) {
                        return Ok(false);
                    }
                    continue;
                }
            };
            let step = factor.solve(&self.normal.gradient);
            let (expected, length) = self.expect(&step);
            let merit = self.merit(&self.current);
            let gain = match self.try_step(&step, 1.0) {
                Some(trial) => (merit - trial) / expected,
                None => f64::NEG_INFINITY,
            };
            if expected <= 1e-15 * merit {
                return Ok(true);
            }
            if gain.is_nan() || gain <= 1e-4 {
                if !self.raise_damping(length) {
                    return Ok(false);
                }
                continue;
            }
            self.accept()?;
            self.record(StepKind::Damped, length, self.damping, 1.0);
            self.damping = (self.damping * (1.0 - (2.0 * gain - 1.0).powi(3)).max(1.0 / 3.0)).max(1e-15);
            self.growth = 2.0;
            if gain > 0.25 && expected <= small_gain * merit {
                return Ok(true);
            }
        }
    }

    fn raise_damping(&mut self, length: f64) -> bool {
        self.record(StepKind::Rejected, length, self.damping, 1.0);
        self.damping *= self.growth;
        self.growth *= 2.0;
        let possible = self.damping < LARGEST_DAMPING;
        if !possible {
            (self.damping, self.growth) = (self.options.initial_damping, 2.0);
        }
        possible
    }

    /// Undamped steps until they are negligible. False where they do not converge; `fallible` says that the caller has
    /// something else to try then.
    fn polish(&mut self, fallible: bool) -> Result<bool> {
        let (mut best, mut idle, mut shortened_steps) = (f64::INFINITY, 0, 0);
        loop {
            self.check_budget()?;
            let Some(step) = self.undamped_step()? else { return Ok(false) };
            let (expected, length) = self.expect(&step);
            idle = if length < best { 0 } else { idle + 1 };
            best = best.min(length);
            match self.undamped(&step, expected, length, idle >= STAGNANT)? {
                Undamped::Converged => return Ok(true),
                Undamped::Moved { shortened } => shortened_steps += usize::from(shortened),
                Undamped::Blocked => return Ok(false),
            }
            if fallible && (shortened_steps > 3 || idle > 3 * STAGNANT) {
                return Ok(false);
            }
        }
    }

    /// The undamped step; `None` where the unknowns are not determined at these values.
    fn undamped_step(&self) -> Result<Option<Vec<f64>>> {
        let factor = self.problem().factorise()?;
        Ok(factor.map(|factor| match factor {
            Factor::Normal(factor) => factor.solve(&self.normal.gradient),
            Factor::Orthogonal(factor) => factor.solve(),
        }))
    }

    /// The linearised problem as it stands.
    pub(crate) fn problem(&self) -> Problem<'_> {
        Problem {
            layout: self.layout,
            linearisation: &self.current,
            constraints: &self.constraints,
            normal: &self.normal,
        }
    }

    fn undamped(&mut self, step: &[f64], expected: f64, length: f64, stagnant: bool) -> Result<Undamped> {
        let redundancy = (self.layout.rows + self.constraints.count).saturating_sub(self.layout.unknowns);
        let sigma0 = if redundancy > 0 { (self.current.vtpv / redundancy as f64).sqrt() } else { 1.0 };
        let negligible = length <= self.options.step_tolerance * sigma0.min(1.0);
        // Rounding may keep the step from becoming negligible; it is harmless far below the standard deviation.
        let harmless = length <= HARMLESS * sigma0.max(1.0);
        let settled = stagnant && harmless;
        let merit = self.merit(&self.current);
        let mut share = 1.0;
        loop {
            let trial = self.try_step(step, share);
            // Below 1e-10 of the objective its rounding hides whether a step is good.
            let hidden = expected.abs() <= 1e-10 * merit || negligible;
            if trial.is_some_and(|trial| hidden || trial <= merit) {
                break;
            }
            if negligible || settled {
                self.record(StepKind::Undamped, length, 0.0, 0.0);
                return Ok(Undamped::Converged);
            }
            share *= 0.5;
            if share < 1e-6 {
                self.record(StepKind::Undamped, length, 0.0, 0.0);
                return Ok(if harmless { Undamped::Converged } else { Undamped::Blocked });
            }
        }
        self.accept()?;
        self.record(StepKind::Undamped, length, 0.0, share);
        Ok(if negligible || settled {
            Undamped::Converged
        } else {
            Undamped::Moved { shortened: share < 0.2 && !harmless }
        })
    }

    /// Expected reduction of the merit function, and the length of the step in standard deviations. Also raises the
    /// penalty so far that the step is a descent ([Nocedal2006], Eq. 18.36).
    fn expect(&mut self, step: &[f64]) -> (f64, f64) {
        self.current.apply(self.layout, step, &mut self.moved);
        let (mut length, mut gain) = (0.0, 0.0);
        for ((m, v), w) in self.moved.iter().zip(&self.current.whitened).zip(&self.current.weights) {
            length += w * m * m;
            gain += w * m * (2.0 * v - m);
        }
        let miss: f64 = self.current.constraint.iter().map(|c| c.abs()).sum();
        if gain < 0.0 && gain + 0.5 * self.penalty * miss < 0.0 && miss > 0.0 {
            self.penalty = -2.0 * gain / miss;
        }
        (gain + self.penalty * miss, length.sqrt())
    }

    fn merit(&self, at: &Linearisation) -> f64 {
        at.objective + self.penalty * at.constraint.iter().map(|c| c.abs()).sum::<f64>()
    }

    /// Merit at `values ⊞ share · step`; `None` where the model has no finite value.
    fn try_step(&mut self, step: &[f64], share: f64) -> Option<f64> {
        let step: Vec<f64> = step.iter().map(|dx| share * dx).collect();
        self.layout.step(self.adjustment, &self.values, &step, &mut self.trial_values);
        let done = self.trial.evaluate(self.adjustment, self.layout, &self.trial_values, Want::Residuals);
        let merit = self.merit(&self.trial);
        (done.is_ok() && merit.is_finite()).then_some(merit)
    }

    fn accept(&mut self) -> Result<()> {
        std::mem::swap(&mut self.values, &mut self.trial_values);
        self.linearise()
    }

    fn record(&mut self, kind: StepKind, step: f64, damping: f64, share: f64) {
        self.trace.push(TraceEntry { kind, objective: self.current.objective, step, damping, share });
    }

    fn check_budget(&self) -> Result<()> {
        if self.trace.len() < self.options.max_iterations {
            return Ok(());
        }
        Err(self.not_converged("the largest number of iterations is reached"))
    }

    fn not_converged(&self, reason: &'static str) -> Error {
        let last = self.trace.last();
        Error::NotConverged {
            iterations: self.trace.len(),
            reason,
            objective: self.current.objective,
            step: last.map_or(f64::NAN, |entry| entry.step),
            damping: last.map_or(0.0, |entry| entry.damping),
        }
    }
}
