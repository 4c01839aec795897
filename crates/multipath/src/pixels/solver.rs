//! The paths of one pixel and the verdict on them.

use statistics::chi_squared_limit;

use crate::TwoPathOptions;
use crate::pixels::model::{Parameters, Prior};
use crate::pixels::pixel::{MAXIMUM_FREQUENCIES, Pixel};
use crate::pixels::profile::is_sigma_reliable;
use crate::pixels::refine::{Fit, refine};
use crate::pixels::search::{Grid, Scratch};
use crate::pixels::single::{SingleFit, refine_single};
use crate::pixels::two_path::{Hypothesis, PixelPaths, Verdict};

/// Solutions whose chi-squared lies less than this above the best one are as likely: `exp(9 / 2)` is odds of 90 to 1. A smaller
/// one gives more pixels a number, and more of them the wrong one.
const AMBIGUITY_MARGIN: f64 = 9.0;
/// Paths count as resolved if their difference in range, and both amplitudes, are at least this many of their own standard
/// deviations: closer to zero the squares about the minimum are no parabola, and the stated deviations would lie.
const RESOLUTION_SIGMAS: f64 = 4.0;

/// What does not depend on the pixel.
#[derive(Debug, Clone)]
pub(crate) struct PixelSolver {
    grid: Grid,
    options: TwoPathOptions,
    thresholds: [f64; 2 * MAXIMUM_FREQUENCIES],
}

/// Working memory of one thread.
#[derive(Debug, Default)]
pub(crate) struct Worker {
    scratch: Scratch,
    single_starts: Vec<f64>,
    singles: Vec<SingleFit>,
    pair_starts: Vec<Parameters>,
    pairs: Vec<Fit>,
    /// Least squares on the way of the starts that came to no minimum.
    lowest_without_minimum: f64,
    hypotheses: Vec<Hypothesis>,
}

impl Worker {
    /// Solutions of the pixel solved last, where its verdict is `Ambiguous` or `Unresolved`.
    pub fn hypotheses(&self) -> &[Hypothesis] {
        &self.hypotheses
    }
}

impl PixelSolver {
    pub fn new(grid: Grid, options: &TwoPathOptions) -> Self {
        let thresholds = std::array::from_fn(|freedom| chi_squared_limit(freedom as f64, options.false_alarm));
        Self { grid, options: *options, thresholds }
    }

    pub fn solve(&self, pixel: &Pixel, worker: &mut Worker) -> PixelPaths {
        worker.hypotheses.clear();
        let frequencies = pixel.terms().len();
        if frequencies < 2 {
            return PixelPaths::without_numbers(Verdict::NoData);
        }
        self.fit_singles(pixel, worker);
        let explained = self.thresholds[2 * frequencies - 2];
        if let Some(best) = worker.singles.first().copied().filter(|fit| fit.chi_squared <= explained) {
            return Self::judge_single(&best, worker);
        }
        self.fit_pairs(pixel, worker);
        let explained = self.thresholds[2 * frequencies - 4];
        let Some(best) = worker.pairs.first().copied() else {
            let open = worker.lowest_without_minimum <= explained;
            return PixelPaths::without_numbers(if open { Verdict::Unresolved } else { Verdict::Inconsistent });
        };
        let verdict = self.judge_pairs(pixel, &best, explained, worker);
        let chi_squared = best.chi_squared as f32;
        match verdict {
            Verdict::Two => two(&best, self.options.diffuse_share),
            Verdict::Inconsistent => PixelPaths { chi_squared, ..PixelPaths::without_numbers(verdict) },
            _ => {
                let pairs = worker.pairs.iter().take_while(|fit| Self::is_as_likely(fit.chi_squared, best.chi_squared));
                worker.hypotheses.extend(pairs.map(Hypothesis::from));
                PixelPaths { chi_squared, ..PixelPaths::without_numbers(verdict) }
            }
        }
    }

    fn is_as_likely(chi_squared: f64, best: f64) -> bool {
        chi_squared <= best + AMBIGUITY_MARGIN
    }

    /// All minima of one path within the span, best first.
    fn fit_singles(&self, pixel: &Pixel, worker: &mut Worker) {
        self.grid.single_starts(pixel, &mut worker.scratch, &mut worker.single_starts);
        let span = self.grid.span;
        let inside = |fit: &SingleFit| (span.nearest_m..=span.farthest_m).contains(&fit.range_m);
        worker.singles.clear();
        worker
            .singles
            .extend(worker.single_starts.iter().filter_map(|start| refine_single(pixel, *start)).filter(inside));
        worker.singles.sort_by(|a, b| a.chi_squared.total_cmp(&b.chi_squared));
    }

    fn judge_single(best: &SingleFit, worker: &mut Worker) -> PixelPaths {
        let rivals = worker.singles.iter().take_while(|fit| Self::is_as_likely(fit.chi_squared, best.chi_squared));
        let chi_squared = best.chi_squared as f32;
        if rivals.clone().count() > 1 {
            worker.hypotheses.extend(rivals.map(Hypothesis::from));
            return PixelPaths { chi_squared, ..PixelPaths::without_numbers(Verdict::Ambiguous) };
        }
        PixelPaths {
            direct_m: best.range_m as f32,
            sigma_direct_m: best.sigma_m as f32,
            amplitude: best.amplitude as f32,
            chi_squared,
            ..PixelPaths::without_numbers(Verdict::Single)
        }
    }

    /// All different minima of two paths within the span, best first.
    fn fit_pairs(&self, pixel: &Pixel, worker: &mut Worker) {
        self.grid.pair_starts(pixel, &mut worker.scratch, &mut worker.pair_starts);
        let no_priors = [Prior::default(); 2];
        worker.pairs.clear();
        worker.lowest_without_minimum = f64::INFINITY;
        for start in &worker.pair_starts {
            match refine(pixel, *start, &no_priors) {
                Ok(fit) if self.is_inside(&fit) && !worker.pairs.iter().any(|other| is_same(other, &fit)) => {
                    worker.pairs.push(fit);
                }
                Ok(_) => {}
                Err(lowest) => worker.lowest_without_minimum = worker.lowest_without_minimum.min(lowest),
            }
        }
        worker.pairs.sort_by(|a, b| a.chi_squared.total_cmp(&b.chi_squared));
    }

    fn is_inside(&self, fit: &Fit) -> bool {
        let [_, _, direct, indirect] = fit.parameters;
        let span = &self.grid.span;
        (span.nearest_m..=span.farthest_m).contains(&direct) && indirect - direct <= span.longest_detour_m
    }

    fn judge_pairs(&self, pixel: &Pixel, best: &Fit, explained: f64, worker: &Worker) -> Verdict {
        let lowest = worker.lowest_without_minimum.min(best.chi_squared);
        if pixel.terms().len() < 3 {
            return Verdict::Ambiguous;
        }
        if lowest > explained {
            return Verdict::Inconsistent;
        }
        if best.chi_squared > explained || Self::is_as_likely(worker.lowest_without_minimum, best.chi_squared) {
            return Verdict::Unresolved;
        }
        if worker.pairs.get(1).is_some_and(|second| Self::is_as_likely(second.chi_squared, best.chi_squared)) {
            return Verdict::Ambiguous;
        }
        let [a, b, direct, indirect] = best.parameters;
        let apart = (indirect - direct) / best.difference_variance(2, 3).sqrt();
        let weakest = apart.min(a / best.sigma(0)).min(b / best.sigma(1));
        let resolved = weakest >= RESOLUTION_SIGMAS && best.sigma(2) <= self.options.largest_sigma_m;
        if resolved && is_sigma_reliable(pixel, best) { Verdict::Two } else { Verdict::Unresolved }
    }
}

/// Whether two minima are one that was reached twice: closer than a tenth of their standard deviations, or rounding.
fn is_same(a: &Fit, b: &Fit) -> bool {
    [2, 3].into_iter().all(|i| (a.parameters[i] - b.parameters[i]).abs() < 1e-6 + 0.1 * a.sigma(i))
}

fn two(fit: &Fit, diffuse_share: f64) -> PixelPaths {
    let hypothesis = Hypothesis::from(fit);
    let model_m = diffuse_share * hypothesis.ratio * (hypothesis.indirect_m - hypothesis.direct_m);
    PixelPaths {
        verdict: Verdict::Two,
        direct_m: hypothesis.direct_m as f32,
        sigma_direct_m: hypothesis.sigma_direct_m.hypot(model_m) as f32,
        indirect_m: hypothesis.indirect_m as f32,
        sigma_indirect_m: hypothesis.sigma_indirect_m as f32,
        amplitude: fit.parameters[0] as f32,
        ratio: hypothesis.ratio as f32,
        sigma_ratio: sigma_ratio(fit) as f32,
        chi_squared: fit.chi_squared as f32,
    }
}

/// Standard deviation of `b / a`.
fn sigma_ratio(fit: &Fit) -> f64 {
    let [a, b, ..] = fit.parameters;
    let (da, db) = (-b / (a * a), 1.0 / a);
    let c = &fit.covariance;
    (da * da * c[0][0] + 2.0 * da * db * c[0][1] + db * db * c[1][1]).sqrt()
}

impl From<&Fit> for Hypothesis {
    fn from(fit: &Fit) -> Self {
        let [a, b, direct_m, indirect_m] = fit.parameters;
        Self {
            direct_m,
            sigma_direct_m: fit.sigma(2),
            indirect_m,
            sigma_indirect_m: fit.sigma(3),
            ratio: b / a,
            chi_squared: fit.chi_squared,
        }
    }
}

impl From<&SingleFit> for Hypothesis {
    fn from(fit: &SingleFit) -> Self {
        Self {
            direct_m: fit.range_m,
            sigma_direct_m: fit.sigma_m,
            indirect_m: f64::NAN,
            sigma_indirect_m: f64::NAN,
            ratio: 0.0,
            chi_squared: fit.chi_squared,
        }
    }
}
