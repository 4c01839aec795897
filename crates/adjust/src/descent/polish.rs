use crate::cofactors::rank::Factor;
use crate::descent::iteration::Iteration;
use crate::linearised::evaluation::Want;
use crate::{Result, StepKind};

/// Undamped steps in a row that may fail to become shorter before they count as stagnant.
const STAGNANT: usize = 4;
/// Standard deviations below which a step that rounding keeps alive (it no longer shortens, or the objective no longer
/// falls along it) does no harm: its reduction of the objective is 1e-12 of one observation's share.
const HARMLESS: f64 = 1e-6;

/// Standard deviations of a step that leaves its factor good for the next one, if that shortens as it should.
const REUSABLE: f64 = 1.0;
/// Share of the last step that the next one with the same factor may have.
const SHORTENING: f64 = 0.1;

/// Observations that fit better than this share of their standard deviation fit exactly.
const SMALLEST_SIGMA0: f64 = 1e-8;

/// What an undamped step did.
enum Undamped {
    Converged,
    /// The share of the step that was taken.
    Moved(f64),
    Blocked,
}

impl Iteration<'_, '_> {
    /// Undamped steps until they are negligible. False where they do not converge; `fallible` says that the caller has
    /// something else to try then.
    pub(crate) fn polish(&mut self, fallible: bool) -> Result<bool> {
        let (mut best, mut idle, mut lost, mut share, mut last) = (f64::INFINITY, 0, 0, 1.0, f64::INFINITY);
        let mut kept: Option<Factor> = None;
        loop {
            self.check_budget()?;
            let Some((factor, step)) = self.undamped_step(kept, last)? else { return Ok(false) };
            let (expected, length) = self.expect(&step);
            idle = if length < best { 0 } else { idle + 1 };
            best = best.min(length);
            // A short step leaves the normal equations as they are, nearly: the next one takes the same factor.
            let keep = length <= REUSABLE && matches!(factor, Factor::Normal(_)) && self.constraints.first_inner == 0;
            match self.undamped(&step, expected, length, idle >= STAGNANT, share, keep)? {
                Undamped::Converged => {
                    self.renew()?;
                    return Ok(true);
                }
                Undamped::Moved(taken) => share = taken,
                Undamped::Blocked => {
                    self.renew()?;
                    return Ok(false);
                }
            }
            kept = keep.then_some(factor);
            // A curved valley: the way through it is for damped steps, unless these shorten quickly.
            lost += usize::from(share < 0.2 && length > 0.5 * last);
            last = length;
            if fallible && (lost > 3 || idle > 3 * STAGNANT) {
                self.renew()?;
                return Ok(false);
            }
        }
    }

    /// The undamped step with its factor, by the one that was kept while it serves; `None` where the unknowns are not
    /// determined at these values.
    fn undamped_step(&mut self, kept: Option<Factor>, last: f64) -> Result<Option<(Factor, Vec<f64>)>> {
        if let Some(factor) = kept {
            let step = factor.step(&self.gradient);
            let (_, length) = self.expect(&step);
            if length <= SHORTENING * last {
                return Ok(Some((factor, step)));
            }
        }
        self.renew()?;
        let factor = self.problem().factorise()?;
        Ok(factor.map(|factor| {
            let step = factor.step(&self.gradient);
            (factor, step)
        }))
    }

    /// Takes the step as far as it is good. Where the model is so curved that only `last` of the last step was, no more
    /// than twice that is tried, and no more than that where rounding hides what is good.
    fn undamped(
        &mut self,
        step: &[f64],
        expected: f64,
        length: f64,
        stagnant: bool,
        last: f64,
        keep: bool,
    ) -> Result<Undamped> {
        let sigma0 = self.sigma0();
        let negligible = length <= self.options.step_tolerance * sigma0.clamp(SMALLEST_SIGMA0, 1.0);
        // Rounding may keep the step from becoming negligible; it is harmless far below the standard deviation.
        let harmless = length <= HARMLESS * sigma0.max(1.0);
        let settled = stagnant && harmless;
        let merit = self.merit(&self.current);
        // Below 1e-10 of the objective its rounding hides whether a step is good.
        let hidden = expected.abs() <= 1e-10 * merit || negligible;
        let mut share = if hidden { last } else { (2.0 * last).min(1.0) };
        while !self.try_step(step, share, Want::Jacobians).is_some_and(|trial| hidden || trial <= merit) {
            share *= 0.5;
            let ended = negligible || settled || share < 1e-6 && harmless;
            if ended || share < 1e-6 {
                self.record(StepKind::Undamped, length, 0.0, 0.0);
                return Ok(if ended { Undamped::Converged } else { Undamped::Blocked });
            }
        }
        self.accept(keep)?;
        self.record(StepKind::Undamped, length, 0.0, share);
        Ok(if negligible || settled { Undamped::Converged } else { Undamped::Moved(share) })
    }

    /// Posterior standard deviation of unit weight at the current values; 1 without redundancy.
    fn sigma0(&self) -> f64 {
        let redundancy = (self.layout.rows + self.constraints.count)
            .saturating_sub(self.layout.unknowns + self.adjustment.excluded_components());
        if redundancy > 0 { (self.current.vtpv / redundancy as f64).sqrt() } else { 1.0 }
    }
}
