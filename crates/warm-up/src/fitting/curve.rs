//! The curve that is fitted, block by block, and time constants to start from.

use crate::DriftBlock;
use crate::fitting::projection::{Basis, dot};
use crate::fitting::whitening::Whitening;

/// Most transients of a model.
pub(crate) const MOST_TRANSIENTS: usize = 2;

/// A constant, amplitude and logarithm of the time constant of each transient, a coefficient of the temperature,
/// coefficient and logarithm of the time constant of what follows the frame rate.
pub(crate) const MOST_UNKNOWNS: usize = 4 + 2 * MOST_TRANSIENTS;

/// Ratio of two time constants below which they are one for any capture.
const LEAST_RATIO: f64 = 1.5;

/// Time constants that are tried.
const GRID: usize = 120;

/// Time constants of the curve that serial correlation is told beside.
const FIXED: usize = 8;

/// What blocks are fitted by: times count from the first block, temperatures from that of the warm camera.
#[derive(Debug, Clone)]
pub(crate) struct Curve<'a> {
    pub(crate) blocks: &'a [DriftBlock],
    pub(crate) length_s: f64,
    /// The warm camera's temperature, where the drift may follow it.
    pub(crate) reference_c: Option<f64>,
    /// What follows the frame rate, where the drift may.
    pub(crate) rate: Option<RateSteps<'a>>,
}

/// The frame rate as the drift follows it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RateSteps<'a> {
    /// Times since power-on and changes of the rate, of [`error_models::RateHistory::steps`].
    pub(crate) steps: &'a [(f64, f64)],
    /// Time constant that a fit starts at, second.
    pub(crate) start_s: f64,
}

/// Mean of `exp(−t / τ)` over a block, `t` from the first block, and its derivative by ln τ.
fn decay(time_s: f64, half_width_s: f64, time_constant_s: f64) -> [f64; 2] {
    let (x, t) = (half_width_s / time_constant_s, time_s / time_constant_s);
    // sinh(x) / x and x times its derivative; the series where they cancel.
    let (mean, slope) = if x < 1e-2 {
        (1.0 + x * x / 6.0, x * x / 3.0 + x.powi(4) / 30.0)
    } else {
        (x.sinh() / x, x.cosh() - x.sinh() / x)
    };
    let decay = (-t).exp();
    [decay * mean, decay * (t * mean - slope)]
}

impl RateSteps<'_> {
    /// Mean over a block of the rate as it is followed, hertz, and its derivative by ln τ.
    fn response(&self, block: &DriftBlock, time_constant_s: f64) -> [f64; 2] {
        let past = self.steps.iter().take_while(|(since_s, _)| *since_s <= block.time_s);
        past.fold([0.0; 2], |[response, slope], (since_s, step)| {
            let [left, by_logarithm] = decay(block.time_s - since_s, block.half_width_s, time_constant_s);
            [response + step * (1.0 - left), slope - step * by_logarithm]
        })
    }
}

impl Curve<'_> {
    pub(crate) fn duration_s(&self) -> f64 {
        self.blocks.last().map_or(0.0, |last| last.time_s) - self.start_s()
    }

    pub(crate) fn start_s(&self) -> f64 {
        self.blocks.first().map_or(0.0, |first| first.time_s)
    }

    /// Transients that so many unknowns belong to.
    fn transients(&self, unknowns: usize) -> usize {
        (unknowns - 1 - usize::from(self.reference_c.is_some()) - 2 * usize::from(self.rate.is_some())) / 2
    }

    /// Value for a block and its derivatives: constant, `a_i, ln τ_i`, temperature, `c, ln τ` of what follows the frame
    /// rate; `a` at the time of the first block.
    pub(crate) fn at(&self, index: usize, unknowns: &[f64]) -> (f64, [f64; MOST_UNKNOWNS]) {
        let block = &self.blocks[index];
        let time_s = block.time_s - self.start_s();
        let mut row = [0.0; MOST_UNKNOWNS];
        row[0] = 1.0;
        let mut value = unknowns[0];
        let transients = self.transients(unknowns.len());
        for (place, pair) in unknowns[1..].chunks_exact(2).take(transients).enumerate() {
            let [decay, by_logarithm] = decay(time_s, block.half_width_s, pair[1].exp());
            (row[1 + 2 * place], row[2 + 2 * place]) = (decay, pair[0] * by_logarithm);
            value += pair[0] * decay;
        }
        let mut place = 1 + 2 * transients;
        if self.reference_c.is_some() {
            row[place] = self.temperature(block);
            value += unknowns[place] * row[place];
            place += 1;
        }
        if let Some(rate) = &self.rate {
            let [response, by_logarithm] = rate.response(block, unknowns[place + 1].exp());
            (row[place], row[place + 1]) = (response, unknowns[place] * by_logarithm);
            value += unknowns[place] * response;
        }
        (value, row)
    }

    fn temperature(&self, block: &DriftBlock) -> f64 {
        block.temperature_c.unwrap_or(f64::NAN) - self.reference_c.unwrap_or(0.0)
    }

    pub(crate) fn observed(&self) -> impl Iterator<Item = f64> {
        self.blocks.iter().map(|block| block.change_m)
    }

    /// Constant and temperature, whitened.
    fn at_rest(&self, whitening: &Whitening) -> Vec<Vec<f64>> {
        let constant = whitening.column(self.blocks.iter().map(|_| 1.0));
        let temperature = self.reference_c.map(|_| whitening.column(self.blocks.iter().map(|b| self.temperature(b))));
        std::iter::once(constant).chain(temperature).collect()
    }

    /// Constant, temperature and what follows the frame rate with the time constant to start from, whitened.
    pub(crate) fn without_transients(&self, whitening: &Whitening) -> Vec<Vec<f64>> {
        let rate = self.rate.map(|rate| self.rate_response(&rate, rate.start_s, whitening));
        self.at_rest(whitening).into_iter().chain(rate).collect()
    }

    /// What follows the frame rate with unit coefficient, whitened.
    pub(crate) fn rate_response(&self, rate: &RateSteps<'_>, time_constant_s: f64, whitening: &Whitening) -> Vec<f64> {
        whitening.column(self.blocks.iter().map(|block| rate.response(block, time_constant_s)[0]))
    }

    /// An exponential of unit amplitude, whitened.
    pub(crate) fn exponential(&self, time_constant_s: f64, whitening: &Whitening) -> Vec<f64> {
        let start_s = self.start_s();
        let value = |block: &DriftBlock| decay(block.time_s - start_s, block.half_width_s, time_constant_s)[0];
        whitening.column(self.blocks.iter().map(value))
    }

    /// Logarithmic steps from two blocks to twice the capture.
    fn time_constants(&self, count: usize) -> impl Iterator<Item = f64> {
        let (shortest, longest) = (2.0 * self.length_s, 2.0 * self.duration_s());
        (0..count).map(move |step| shortest * (longest / shortest).powf(step as f64 / (count - 1) as f64))
    }

    /// All time constants that are tried.
    pub(crate) fn grid(&self) -> Vec<f64> {
        self.time_constants(GRID).collect()
    }

    /// A linear curve that follows any sum of two exponentials far below noise, and any response to the frame rate where
    /// there may be one: exponentials of fixed time constants.
    pub(crate) fn flexible(&self, whitening: &Whitening) -> Basis {
        let exponentials = self.time_constants(FIXED).map(|tau| self.exponential(tau, whitening));
        let fixed = |rate| self.time_constants(FIXED).map(move |tau| self.rate_response(&rate, tau, whitening));
        let responses = self.rate.into_iter().flat_map(fixed);
        Basis::of(self.at_rest(whitening).into_iter().chain(exponentials).chain(responses))
    }

    /// The time constants of a grid that leave the smallest sum of squares: all other unknowns are linear (variable
    /// projection).
    pub(crate) fn start(&self, transients: usize, whitening: &Whitening) -> Vec<f64> {
        let rest = Basis::of(self.without_transients(whitening));
        let observed = rest.residual(whitening.column(self.observed()));
        let candidate = |tau: f64| Some((tau, rest.direction(self.exponential(tau, whitening))?));
        // Half of the grid is near enough to start from.
        let candidates: Vec<(f64, Vec<f64>)> = self.time_constants(GRID / 2).filter_map(candidate).collect();
        let shares: Vec<f64> = candidates.iter().map(|(_, direction)| dot(direction, &observed)).collect();
        let mut best = (f64::NEG_INFINITY, Vec::new());
        for (i, (first, direction)) in candidates.iter().enumerate() {
            if transients < 2 && shares[i].powi(2) > best.0 {
                best = (shares[i].powi(2), vec![*first]);
            }
            for (j, (second, other)) in candidates.iter().enumerate().skip(i + 1) {
                if transients < 2 || second / first < LEAST_RATIO {
                    continue;
                }
                let g = dot(direction, other);
                let (a, b) = (shares[i], shares[j]);
                let explained = (a * a + b * b - 2.0 * a * b * g) / (1.0 - g * g);
                if explained > best.0 {
                    best = (explained, vec![*first, *second]);
                }
            }
        }
        best.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_of_an_exponential_over_a_block_is_that_of_its_samples() {
        let tau = 50.0;
        for count in [1_u32, 4, 400] {
            let times: Vec<f64> = (0..count).map(|k| 100.0 + 40.0 * f64::from(k) / f64::from(count)).collect();
            let mean = times.iter().sum::<f64>() / f64::from(count);
            let variance = times.iter().map(|t| (t - mean).powi(2)).sum::<f64>() / f64::from(count);
            let expected = times.iter().map(|t| (-t / tau).exp()).sum::<f64>() / f64::from(count);
            let [value, _] = decay(mean, (3.0 * variance).sqrt(), tau);
            // The fourth moments of few samples and of a stretch differ: 2e-5 of the value for four samples.
            assert!((value / expected - 1.0).abs() < 3e-5, "{count}: {value} for {expected}");
        }
    }

    #[test]
    fn the_series_of_a_short_block_meets_the_closed_form() {
        for half_width in [0.0099 * 70.0, 0.0101 * 70.0] {
            let step = 1e-5_f64;
            let [_, slope] = decay(90.0, half_width, 70.0);
            let beside = [step, -step].map(|d| decay(90.0, half_width, 70.0 * d.exp())[0]);
            // Central differences of step 1e-5 are good to 1e-10.
            assert!((slope - (beside[0] - beside[1]) / (2.0 * step)).abs() < 1e-9);
        }
    }
}
