//! Intervals of the length of a vector with normal errors.

use statistics::Distribution;

/// Standard deviations along the vector and across it: beyond this length its direction is known to a tenth of a radian, and the
/// normal interval of the length is right to a hundredth of a standard deviation.
const LONG: f64 = 10.0;
/// Intervals of the integral over the component along the vector, and standard deviations to either side that it runs over: smooth
/// integrands are right to 1e-8.
const INTERVALS: usize = 400;
const REACH: f64 = 8.0;
/// Halvings of the bracket of a root: down to rounding.
const HALVINGS: usize = 60;

/// Two-sided interval of the true length of a vector whose length was found to be `value`: the lengths of which what was found
/// is neither too small nor too large at half the level. `across` has the standard deviations of one or two components
/// across; two count as equal.
pub(super) fn interval(value: f64, along: f64, across: &[f64], level: f64) -> [f64; 2] {
    let squares: f64 = across.iter().map(|sigma| sigma * sigma).sum();
    let spread = Spread { along, across: (squares / across.len() as f64).sqrt(), is_flat: across.len() == 1 };
    let half = Distribution::Normal.critical(level) * along;
    // Without errors along the vector the integral has no density; what it says then is the limit.
    let is_open = along > 0.0 && spread.across > 0.0;
    if value > LONG * along.max(spread.across) || !is_open {
        return [(value - half).max(0.0), value + half];
    }
    [spread.length(value, 1.0 - 0.5 * level), spread.length(value, 0.5 * level)]
}

struct Spread {
    along: f64,
    across: f64,
    /// One component across, or two.
    is_flat: bool,
}

impl Spread {
    /// The true length under which a length of at most `found` has this probability; zero where none is so probable.
    fn length(&self, found: f64, probability: f64) -> f64 {
        let (mut low, mut high) = (0.0, found + REACH * (self.along + self.across));
        if self.probability(found, low) <= probability {
            return 0.0;
        }
        for _ in 0..HALVINGS {
            let middle = f64::midpoint(low, high);
            if self.probability(found, middle) > probability { low = middle } else { high = middle }
        }
        f64::midpoint(low, high)
    }

    /// Probability of a length of at most `found` where the true one is `length`.
    fn probability(&self, found: f64, length: f64) -> f64 {
        let ends = [-found, found].map(|end| ((end - length) / self.along).clamp(-REACH, REACH));
        let step = (ends[1] - ends[0]) / INTERVALS as f64;
        let at = |index: usize| {
            let deviation = ends[0] + step * index as f64;
            let along = length + deviation * self.along;
            let rest = ((found - along) * (found + along)).max(0.0).sqrt() / self.across;
            let within = if self.is_flat {
                1.0 - 2.0 * Distribution::Normal.survival(rest)
            } else {
                -(-0.5 * rest * rest).exp_m1()
            };
            (-0.5 * deviation * deviation).exp() * within
        };
        // Simpson's rule.
        let weight = |index: usize| {
            let is_end = index == 0 || index == INTERVALS;
            if is_end { 1.0 } else { 2.0 + 2.0 * (index & 1) as f64 }
        };
        let sum: f64 = (0..=INTERVALS).map(|index| weight(index) * at(index)).sum();
        sum * step / 3.0 / std::f64::consts::TAU.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_equal_spread_it_is_rices_distribution() {
        // Rayleigh's where the true length is zero.
        let spread = Spread { along: 2.0, across: 2.0, is_flat: true };
        assert!((spread.probability(3.0, 0.0) - (1.0 - (-9.0_f64 / 8.0).exp())).abs() < 1e-4);
        // Maxwell's in space: P(r < 1) = erf(1/√2) − √(2/π) e^(−1/2).
        let spread = Spread { along: 1.0, across: 1.0, is_flat: false };
        assert!((spread.probability(1.0, 0.0) - 0.198_748).abs() < 1e-4);
    }

    #[test]
    #[allow(clippy::float_cmp)]
    fn long_vectors_have_the_normal_interval_and_short_ones_begin_at_zero() {
        let [low, high] = interval(9.9, 1.0, &[1.0], 0.05);
        assert!((low - (9.9 - 1.96)).abs() < 0.06 && (high - (9.9 + 1.96)).abs() < 0.06, "{low} {high}");
        assert_eq!(interval(0.5, 1.0, &[1.0], 0.05)[0], 0.0);
    }
}
