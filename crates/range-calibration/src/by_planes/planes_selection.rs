//! Which pixels of the captures take part: those that a robust adjustment, and then their own, finds near.

use crate::Result;
use crate::by_planes::planes_observation::Weighting;
use crate::by_planes::planes_pixels::PlanePixels;
use crate::by_planes::planes_problem::{Problem, Solved};

/// Rounds in which pixels are left out and taken in again. A few at the limit may go to and fro for ever; it does not
/// matter which of them the last round had.
const ROUNDS: usize = 20;

/// Standard deviations of its parameters by which a round must move them, that another follows. What moves less shows
/// in no digit that is reported.
const MOVED: f64 = 0.01;

/// Pixels of a capture that are enough to choose by.
const FEW: usize = 4000;

/// Multiple of the largest inflation from which the start values are enough to refuse.
const HOPELESS: f64 = 10.0;

/// Scatter, in standard deviations as given, below which it is rounding.
const SMALLEST_SCATTER: f64 = 1e-6;

impl Problem<'_> {
    /// Least squares, without the pixels that a robust adjustment finds far off.
    pub(crate) fn solve_without_gross_errors(&mut self) -> Result<Solved> {
        let mut pixels = std::mem::take(&mut self.pixels);
        let solved = self.choose_and_solve(&mut pixels);
        self.pixels = pixels;
        solved
    }

    /// The scatter, and which pixels are far off, are found from a few pixels of each capture; all take part in the last
    /// rounds.
    fn choose_and_solve(&self, pixels: &mut [PlanePixels]) -> Result<Solved> {
        self.require_redundancy(pixels)?;
        let mut few: Vec<_> = pixels.iter().map(|pixels| pixels.thinned(FEW)).collect();
        // Far beyond the limit no descent is worth while; near it the solution tells better than the start.
        let hopeless = HOPELESS * self.options.terms.largest_inflation;
        if let Some(error) = self.undetermined_at_start(&few, hopeless)? {
            return Err(error);
        }
        let Some(limit) = self.options.rejection else { return self.solve(pixels, Weighting::LeastSquares, None) };
        let robust = self.solve(&few, Weighting::Huber, None)?;
        let limit = limit * scatter(self.residuals(&few, &robust)?.concat());
        let start = self.settle(&mut few, robust, limit)?;
        self.settle(pixels, start, limit)
    }

    /// Rounds of choosing by the residuals and solving, until the choice stays or hardly matters any more.
    fn settle(&self, pixels: &mut [PlanePixels], mut solved: Solved, limit: f64) -> Result<Solved> {
        for round in 0..ROUNDS {
            let changed = select(pixels, &self.residuals(pixels, &solved)?, limit);
            if !changed && round > 0 {
                break;
            }
            self.require_redundancy(pixels)?;
            let next = self.solve(pixels, Weighting::LeastSquares, Some(&solved))?;
            let moved = next.moved_from(&solved)?;
            solved = next;
            if moved <= MOVED && round > 0 {
                break;
            }
        }
        Ok(solved)
    }
}

/// Lets the pixels take part whose residual is within the limit. Whether that is a change.
fn select(pixels: &mut [PlanePixels], residuals: &[Vec<f64>], limit: f64) -> bool {
    let mut changed = false;
    for (pixels, residuals) in pixels.iter_mut().zip(residuals) {
        for (used, residual) in pixels.used.iter_mut().zip(residuals) {
            let within = residual.abs() <= limit;
            changed |= *used != within;
            *used = within;
        }
    }
    changed
}

/// Standard deviation of the bulk of some residuals.
fn scatter(mut residuals: Vec<f64>) -> f64 {
    if residuals.is_empty() {
        return SMALLEST_SCATTER;
    }
    for residual in &mut residuals {
        *residual = residual.abs();
    }
    statistics::mad_scale(&mut residuals).max(SMALLEST_SCATTER)
}
