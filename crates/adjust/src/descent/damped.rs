use crate::descent::iteration::{Ending, Iteration};
use crate::equations::normal::Singular;
use crate::equations::system::SystemFactor;
use crate::linearised::evaluation::Want;
use crate::{Result, StepKind};

/// Damping beyond which a damped step is no step any more.
const LARGEST_DAMPING: f64 = 1e20;
/// Longest second-order part of a step, relative to the first-order part [Transtrum2012].
const LONGEST_BEND: f64 = 0.375;
/// Difference of found and expected reduction, relative, up to which the model did what was expected.
const EXPECTED: f64 = 0.1;
/// Where the model is probed for its curvature, as a share of the step.
const PROBE: f64 = 0.1;

impl Iteration<'_, '_> {
    /// Damped steps until the ending. False where no step reduces the objective any more.
    pub(crate) fn descend_damped(&mut self, ending: &Ending) -> Result<bool> {
        loop {
            self.check_budget()?;
            let reference = (self.damping, self.metric.as_slice());
            let factor = match self.system.factor(&self.constraints, Some(reference)) {
                Ok(factor) => Some(factor),
                Err(Singular::Constraints(error)) => return Err(error),
                Err(Singular::Normal) => None,
            };
            let mut expected = f64::NAN;
            let mut length = f64::NAN;
            let mut gain = f64::NEG_INFINITY;
            let merit = self.merit(&self.current);
            if let Some(factor) = factor {
                let step = factor.solve(&self.gradient, 1.0);
                (expected, length) = self.expect(&step);
                if expected <= 1e-15 * merit {
                    return Ok(true);
                }
                gain = self.bend(&factor, step).map_or(gain, |trial| (merit - trial) / expected);
            }
            if gain.is_nan() || gain <= 1e-4 {
                if !self.raise_damping(length) {
                    return Ok(false);
                }
                continue;
            }
            self.accept(false)?;
            self.record(StepKind::Damped, length, self.damping, 1.0);
            self.lower_damping(gain, merit, expected);
            if self.damping <= ending.damping || ending.is_reached(merit, expected, gain, self.layout.rows) {
                return Ok(true);
            }
        }
    }

    /// Follows the curvature of the model (geodesic acceleration) and gives the merit at the end of the step. `None`
    /// where the model has no value there, or bends so much that the step means nothing. A model that the last step
    /// found as expected is not probed.
    fn bend(&mut self, factor: &SystemFactor, mut step: Vec<f64>) -> Option<f64> {
        if (self.last_gain - 1.0).abs() > EXPECTED {
            self.try_step(&step, PROBE, Want::Residuals)?;
            let second = self.second_derivative();
            let bend = factor.solve(&self.current.transpose_apply(self.layout, &second), 0.0);
            let metric = &self.metric;
            let norm = |x: &[f64]| x.iter().zip(metric).map(|(x, m)| (x / m).powi(2)).sum::<f64>().sqrt();
            let ratio = norm(&bend) / norm(&step);
            if ratio.is_nan() || ratio > LONGEST_BEND {
                return None;
            }
            step.iter_mut().zip(&bend).for_each(|(dx, b)| *dx += b);
        }
        self.try_step(&step, 1.0, Want::Jacobians)
    }

    /// Half the second derivative of the residuals along the step, from the probe in `trial` and `A·dx` in `moved`.
    fn second_derivative(&self) -> Vec<f64> {
        let rows = self.trial.whitened.iter().zip(&self.current.whitened).zip(&self.moved);
        rows.map(|((probe, v), moved)| ((probe - v) / PROBE + moved) / PROBE).collect()
    }

    fn lower_damping(&mut self, gain: f64, merit: f64, expected: f64) {
        // Nielsen's rule [Nielsen1999]. A model that did what was expected, measured by what is left of the objective
        // as well (far from the solution nearly all of it goes, whatever the step), needs hardly any damping. Not so where
        // less was just refused: short steps always do what is expected, and the same would be refused again and again.
        let miss = (gain - 1.0).abs() * expected;
        let as_expected = miss <= EXPECTED * expected.min(merit - expected);
        let least = if as_expected && self.growth <= 2.0 { 0.01 } else { 1.0 / 3.0 };
        self.damping = (self.damping * (1.0 - (2.0 * gain - 1.0).powi(3)).max(least)).max(1e-30);
        (self.growth, self.last_gain) = (2.0, gain);
    }

    fn raise_damping(&mut self, length: f64) -> bool {
        self.record(StepKind::Rejected, length, self.damping, 1.0);
        self.last_gain = 0.0;
        self.damping *= self.growth;
        self.growth *= 2.0;
        let possible = self.damping < LARGEST_DAMPING;
        if !possible {
            (self.damping, self.growth) = (self.options.initial_damping, 2.0);
        }
        possible
    }
}
