//! Ranges or depths: what the surfaces of all frames say together.

use std::fmt;

use crate::surfaces::Bending;

/// Standard deviation of what surfaces of one camera are bent alike by, whatever the values are: periodic errors, those
/// that go with amplitude, light in corners, a principal distance off by 5 %. Larger, less is told.
const COMMON: f64 = 0.15;
/// Bendings that are thought of.
const SPAN: [f64; 2] = [-2.0, 3.0];
const STEP: f64 = 0.02;
/// Scatter of surfaces beyond their own deviations: that of walls and that of furniture.
const SCATTERS: [f64; 7] = [0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.6];
/// Part of the windows that show no plane.
const OTHER_SHARES: [f64; 3] = [0.02, 0.1, 0.4];
/// Standard deviation of the bending of windows that show no plane.
const OTHER_SIGMA: f64 = 8.0;
/// Probability before any frame that the values are neither (a lens that is not as stated, a depth from disparities).
const NEITHER: f64 = 0.01;

/// What stored values are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Distance from the perspective centre.
    Range,
    /// Distance along the viewing axis.
    Depth,
}

/// How probable it is that values are ranges, or depths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KindJudgement {
    /// Probability that they are ranges.
    pub range: f64,
    /// Probability that they are depths.
    pub depth: f64,
    /// Probability that they are neither: surfaces are bent by some other amount.
    pub neither: f64,
    /// 0 where surfaces are plane as ranges, 1 where as depths: mean over all surfaces.
    pub bending: f64,
    /// Its standard deviation, from how surfaces scatter.
    pub sigma: f64,
    /// Surfaces that were found.
    pub surfaces: usize,
}

impl KindJudgement {
    /// Probability from which on a kind counts as told: one judgement in a hundred may be wrong.
    pub const LEVEL: f64 = 0.99;

    /// The kind, where it can be told.
    pub fn told(&self) -> Option<Kind> {
        if self.range >= Self::LEVEL {
            Some(Kind::Range)
        } else if self.depth >= Self::LEVEL {
            Some(Kind::Depth)
        } else {
            None
        }
    }
}

/// What was told, how surely and by what, in a line.
impl fmt::Display for KindJudgement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = self.surfaces;
        let seen = |f: &mut fmt::Formatter<'_>| {
            let (plural, bending, sigma) = (if count == 1 { "" } else { "s" }, self.bending, self.sigma);
            write!(
                f,
                "{count} surface{plural} bent by {bending:.2} +- {sigma:.2}, 0: plane as ranges, 1: plane as depths)"
            )
        };
        match self.told() {
            Some(Kind::Range) => write!(f, "ranges along the ray (probability {}; ", in_words(self.range))?,
            Some(Kind::Depth) => write!(f, "depths along the axis (probability {}; ", in_words(self.depth))?,
            None if count == 0 => return f.write_str("ranges or depths: cannot be told, no smooth surface was found"),
            None => {
                let (range, depth, neither) = (self.range, self.depth, self.neither);
                f.write_str("ranges or depths: cannot be told (")?;
                write!(f, "probability of ranges {range:.2}, of depths {depth:.2}, of neither {neither:.2}; ")?;
            }
        }
        seen(f)
    }
}

/// A probability in words: "0.995", or "above 0.999".
pub fn in_words(probability: f64) -> String {
    if probability > 0.999 { "above 0.999".to_owned() } else { format!("{probability:.3}") }
}

/// Judges the surfaces of one camera's frames, as [`bendings`](crate::bendings) gives them.
///
/// Posterior probabilities: ranges and depths are as probable before, "neither" has one in a hundred. The bending common to all
/// surfaces is 0 or 1 up to a deviation of 0.15; those of single surfaces scatter about it by their own deviations and
/// by an unknown one, and an unknown part of them is no plane: both are averaged over.
pub fn judge_kind(surfaces: &[Bending]) -> KindJudgement {
    let steps = ((SPAN[1] - SPAN[0]) / STEP).round() as usize;
    let bendings: Vec<f64> = (0..=steps).map(|step| SPAN[0] + STEP * step as f64).collect();
    let logs: Vec<f64> = bendings.iter().map(|bending| log_likelihood(surfaces, *bending)).collect();
    let highest = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let likelihoods: Vec<f64> = logs.iter().map(|log| (log - highest).exp()).collect();
    let sum = |weight: &dyn Fn(f64) -> f64| -> f64 {
        bendings.iter().zip(&likelihoods).map(|(bending, likelihood)| weight(*bending) * likelihood).sum::<f64>() * STEP
    };
    let kinds = 0.5 * (1.0 - NEITHER);
    let range = kinds * sum(&|bending| normal(bending, COMMON));
    let depth = kinds * sum(&|bending| normal(bending - 1.0, COMMON));
    let neither = NEITHER * sum(&|_| 1.0 / (SPAN[1] - SPAN[0]));
    let all = range + depth + neither;
    let flat = sum(&|_| 1.0);
    let bending = sum(&|bending| bending) / flat;
    let variance = sum(&|other| (other - bending).powi(2)) / flat;
    KindJudgement {
        range: range / all,
        depth: depth / all,
        neither: neither / all,
        bending,
        sigma: variance.sqrt(),
        surfaces: surfaces.len(),
    }
}

/// Averaged over the scatter of the surfaces and the part of other shapes.
fn log_likelihood(surfaces: &[Bending], bending: f64) -> f64 {
    let grid = SCATTERS.iter().flat_map(|scatter| OTHER_SHARES.iter().map(move |share| (*scatter, *share)));
    let logs: Vec<f64> = grid
        .map(|(scatter, share)| {
            let one = |surface: &Bending| {
                let off = surface.bending - bending;
                let plane = normal(off, surface.sigma.hypot(scatter));
                let other = normal(surface.bending - 0.5, surface.sigma.hypot(OTHER_SIGMA));
                ((1.0 - share) * plane + share * other).ln()
            };
            surfaces.iter().map(one).sum::<f64>()
        })
        .collect();
    let highest = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    highest + (logs.iter().map(|log| (log - highest).exp()).sum::<f64>() / logs.len() as f64).ln()
}

fn normal(off: f64, sigma: f64) -> f64 {
    (-0.5 * (off / sigma).powi(2)).exp() / (sigma * std::f64::consts::TAU.sqrt())
}
