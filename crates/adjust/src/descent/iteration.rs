use crate::cofactors::rank::Problem;
use crate::equations::constraints::Constraints;
use crate::equations::system::System;
use crate::linearised::evaluation::Want;
use crate::linearised::layout::Layout;
use crate::linearised::linearisation::Linearisation;
use crate::{Adjustment, Error, Method, Result, SolveOptions, StepKind, TraceEntry};

/// A damped step that is expected to reduce the objective by less than this share ends the descent.
const SMALL_GAIN: f64 = 1e-3;

/// Damping that is none any more: undamped steps go on from there, which need fewer factorisations.
const SMALL_DAMPING: f64 = 2e-6;

/// Squared residual, in variances, below which an observation fits exactly.
const EXACT: f64 = 1e-16;

/// Share by which the metric of the damping forgets earlier, longer columns in an iteration. Never forgetting [More1978]
/// crawls where the start was steep; forgetting at once lets parameters run away on plateaus.
const FORGETTING: f64 = 2.0;

/// When a descent has done its work.
pub(crate) struct Ending {
    /// A step was taken that promised less than this share of the objective.
    pub(crate) gain: f64,
    /// A step was taken that reduced the objective by no more than this share.
    pub(crate) decrease: f64,
    /// The model did so well what was expected that the damping fell below this.
    pub(crate) damping: f64,
}

impl Ending {
    /// Whether a step taken from `merit` ended the descent; `gain` is found over expected reduction.
    pub(crate) fn is_reached(&self, merit: f64, expected: f64, gain: f64, rows: usize) -> bool {
        let exact = merit <= EXACT * rows as f64;
        gain > 0.25 && (expected <= self.gain * merit || exact) || gain * expected <= self.decrease * merit
    }
}

/// The state of one run.
pub(crate) struct Iteration<'p, 'a> {
    pub(crate) adjustment: &'p Adjustment<'a>,
    pub(crate) layout: &'p Layout,
    pub(crate) options: &'p SolveOptions,
    pub(crate) values: Vec<f64>,
    pub(crate) current: Linearisation,
    pub(crate) constraints: Constraints,
    pub(crate) system: System,
    /// `AᵀPv` at the current values.
    pub(crate) gradient: Vec<f64>,
    /// Whether the normal equations are those of the current values.
    is_renewed: bool,
    pub(crate) trace: Vec<TraceEntry>,
    pub(crate) trial: Linearisation,
    /// Whether the trial has derivatives, so that it need not be evaluated again when it is accepted.
    trial_is_linearised: bool,
    pub(crate) trial_values: Vec<f64>,
    pub(crate) moved: Vec<f64>,
    /// Weight of the constraints in the merit function (exact penalty: above the largest multiplier).
    pub(crate) penalty: f64,
    pub(crate) damping: f64,
    pub(crate) growth: f64,
    /// Ratio of found to expected reduction in the last damped step.
    pub(crate) last_gain: f64,
    /// Column norms, as scale factors, with a memory of longer ones: the metric of the damping.
    pub(crate) metric: Vec<f64>,
    /// Whether steps that take a parameter's action away are refused.
    pub(crate) cautious: bool,
}

impl<'p, 'a> Iteration<'p, 'a> {
    pub(crate) fn new(adjustment: &'p Adjustment<'a>, layout: &'p Layout, options: &'p SolveOptions) -> Result<Self> {
        let values = adjustment.start();
        let mut this = Self {
            adjustment,
            layout,
            options,
            trial_values: values.clone(),
            values,
            current: Linearisation::new(layout),
            constraints: Constraints::default(),
            system: System::new(adjustment, layout)?,
            gradient: Vec::new(),
            is_renewed: false,
            trace: Vec::new(),
            trial: Linearisation::new(layout),
            trial_is_linearised: false,
            moved: vec![0.0; layout.rows],
            penalty: 0.0,
            damping: options.initial_damping,
            growth: 2.0,
            last_gain: 0.0,
            metric: vec![f64::INFINITY; layout.unknowns],
            cautious: false,
        };
        this.current.evaluate(adjustment, layout, &this.values, Want::Jacobians)?;
        this.linearise()?;
        Ok(this)
    }

    /// Everything that follows from the derivatives in `current`.
    pub(crate) fn linearise(&mut self) -> Result<()> {
        self.is_renewed = true;
        let structure = self.system.structure();
        self.constraints = Constraints::new(self.adjustment, self.layout, &self.current, &self.values, structure)?;
        self.system.accumulate(self.layout, &self.current);
        self.system.gradient().clone_into(&mut self.gradient);
        let scale = self.system.scale();
        self.metric.iter_mut().zip(scale).for_each(|(metric, scale)| *metric = (FORGETTING * *metric).min(scale));
        Ok(())
    }

    /// Forms the normal equations where [`Self::accept`] left the old ones.
    pub(crate) fn renew(&mut self) -> Result<()> {
        if self.is_renewed { Ok(()) } else { self.linearise() }
    }

    /// Runs to the end; the state is then linearised at the solution. A descent that ran away is tried once more, with
    /// more caution.
    pub(crate) fn run(&mut self) -> Result<()> {
        if self.layout.unknowns == 0 {
            return Ok(());
        }
        match self.find_end() {
            Err(Error::NotConverged { .. }) if self.vanished()?.is_some() => {}
            done => return done,
        }
        if self.options.method != Method::GaussNewton && self.trace.len() < self.options.max_iterations {
            self.start_again()?;
            match self.find_end() {
                Err(Error::NotConverged { .. }) if self.vanished()?.is_some() => {}
                done => return done,
            }
        }
        Err(self.ran_away())
    }

    fn find_end(&mut self) -> Result<()> {
        let mut ending = Ending { gain: SMALL_GAIN, decrease: 0.0, damping: SMALL_DAMPING };
        let mut damped = self.options.method != Method::GaussNewton;
        loop {
            let descended = !damped || self.descend_damped(&ending)?;
            if self.polish(damped && descended)? {
                return Ok(());
            }
            // Undamped steps led nowhere: descend further before they are tried again.
            damped = true;
            (ending.gain, ending.damping) = (1e-2 * ending.gain, 0.0);
            if !descended || ending.gain < 1e-30 || self.options.method == Method::GaussNewton {
                return Err(self.not_converged("neither damped nor undamped steps lead on"));
            }
        }
    }

    /// The linearised problem as it stands.
    pub(crate) fn problem(&self) -> Problem<'_> {
        Problem {
            layout: self.layout,
            linearisation: &self.current,
            constraints: &self.constraints,
            system: &self.system,
        }
    }

    /// Expected reduction of the merit function, and the length of the step in standard deviations; the distance to the
    /// constraints is part of it.
    pub(crate) fn expect(&mut self, step: &[f64]) -> (f64, f64) {
        self.current.apply(self.layout, step, &mut self.moved);
        let (mut square, mut gain) = (0.0, 0.0);
        for ((m, v), w) in self.moved.iter().zip(&self.current.whitened).zip(&self.current.weights) {
            square += w * m * m;
            gain += w * m * (2.0 * v - m);
        }
        if self.constraints.first_inner > 0 {
            let scale = self.system.scale();
            square += self.constraints.scaled(&scale).right.iter().map(|d| d * d).sum::<f64>();
            self.raise_penalty(&scale);
        }
        (gain + self.penalty * self.restored(step), square.sqrt())
    }

    /// What the step takes off the sum of the absolute misses of the user's constraints, as far as they are linear.
    fn restored(&self, step: &[f64]) -> f64 {
        let rows = self.constraints.rows.chunks_exact(step.len().max(1)).zip(&self.current.constraint);
        let restored = rows.map(|(row, miss)| {
            let moved: f64 = row.iter().zip(step).map(|(b, dx)| b * dx).sum();
            miss.abs() - (miss - moved).abs()
        });
        restored.sum()
    }

    /// Keeps the penalty at twice the largest Lagrange multiplier: then the merit function is smallest at the solution
    /// ([Nocedal2006], Theorem 17.3). `moved` holds `A·dx`.
    fn raise_penalty(&mut self, scale: &[f64]) {
        let rest: Vec<f64> = self.current.whitened.iter().zip(&self.moved).map(|(v, m)| v - m).collect();
        let force = self.current.transpose_apply(self.layout, &rest);
        // The multipliers belong to vᵀPv / 2, the merit to vᵀPv.
        let largest = self.constraints.multipliers(scale, &force).iter().fold(0.0, |a: f64, m| a.max(2.0 * m.abs()));
        if largest.is_finite() {
            self.penalty = self.penalty.max(2.0 * largest);
        }
    }

    pub(crate) fn merit(&self, at: &Linearisation) -> f64 {
        at.objective + self.penalty * at.constraint.iter().map(|c| c.abs()).sum::<f64>()
    }

    /// Merit at `values ⊞ share · step`; `None` where the model has no finite value. Derivatives are wanted where the
    /// step is likely to be accepted: then nothing is evaluated twice.
    pub(crate) fn try_step(&mut self, step: &[f64], share: f64, want: Want) -> Option<f64> {
        let step: Vec<f64> = step.iter().map(|dx| share * dx).collect();
        self.layout.step(self.adjustment, &self.values, &step, &mut self.trial_values);
        let done = self.trial.evaluate(self.adjustment, self.layout, &self.trial_values, want);
        self.trial_is_linearised = want == Want::Jacobians && done.is_ok();
        let merit = self.merit(&self.trial);
        let refused = self.cautious && self.trial_is_linearised && self.loses_action();
        (done.is_ok() && merit.is_finite() && !refused).then_some(merit)
    }

    /// Moves to the trial values. With `keep` the normal equations stay those of before, but for the gradient.
    pub(crate) fn accept(&mut self, keep: bool) -> Result<()> {
        std::mem::swap(&mut self.values, &mut self.trial_values);
        if self.trial_is_linearised {
            std::mem::swap(&mut self.current, &mut self.trial);
        } else {
            self.current.evaluate(self.adjustment, self.layout, &self.values, Want::Jacobians)?;
        }
        if keep {
            self.gradient = self.current.transpose_apply(self.layout, &self.current.whitened);
            self.is_renewed = false;
            return Ok(());
        }
        self.linearise()
    }

    pub(crate) fn record(&mut self, kind: StepKind, step: f64, damping: f64, share: f64) {
        self.trace.push(TraceEntry { kind, objective: self.current.objective, step, damping, share });
    }

    pub(crate) fn check_budget(&self) -> Result<()> {
        if self.trace.len() < self.options.max_iterations {
            return Ok(());
        }
        Err(self.not_converged("the largest number of iterations is reached"))
    }

    /// The unknown that the next damped step would move most, in units of its column's norm.
    pub(crate) fn unsettled(&self) -> Option<usize> {
        let reference = (self.damping.max(SMALL_DAMPING), self.metric.as_slice());
        let step = self.system.factor(&self.constraints, Some(reference)).ok()?.solve(&self.gradient, 1.0);
        let size = |unknown: usize| (step[unknown] / self.metric[unknown]).abs();
        (0..step.len()).filter(|&unknown| size(unknown).is_finite()).max_by(|&a, &b| size(a).total_cmp(&size(b)))
    }

    pub(crate) fn not_converged(&self, reason: &'static str) -> Error {
        let last = self.trace.last();
        Error::NotConverged {
            iterations: self.trace.len(),
            reason,
            objective: self.current.objective,
            step: last.map_or(f64::NAN, |entry| entry.step),
            damping: last.map_or(0.0, |entry| entry.damping),
            parameter: String::new(),
        }
    }
}
