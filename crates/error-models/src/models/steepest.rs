//! Where range-dependent terms change fastest.

/// Samples of one ambiguity interval; the shortest wavelength of Eq. 14 gets a quarter of them.
const SAMPLES_PER_INTERVAL: f64 = 512.0;

/// Samples of a span of many intervals.
const MOST_SAMPLES: f64 = 65_536.0;

/// Largest slope in a span and where it is: the best of dense samples, then golden-section search around it.
pub(crate) fn steepest([low, high]: [f64; 2], interval_m: f64, slope: impl Fn(f64) -> f64) -> (f64, f64) {
    let samples = ((high - low) / interval_m * SAMPLES_PER_INTERVAL).clamp(SAMPLES_PER_INTERVAL, MOST_SAMPLES).ceil();
    let step = (high - low) / samples;
    let places = (0..=samples as u32).map(|i| low + f64::from(i) * step);
    let best = places.max_by(|a, b| slope(*a).total_cmp(&slope(*b))).unwrap_or(low);
    let mut bracket = [(best - step).max(low), (best + step).min(high)];
    let golden = (5.0_f64.sqrt() - 1.0) / 2.0;
    for _ in 0..50 {
        let width = golden * (bracket[1] - bracket[0]);
        let inner = [bracket[1] - width, bracket[0] + width];
        if slope(inner[0]) > slope(inner[1]) {
            bracket[1] = inner[1];
        } else {
            bracket[0] = inner[0];
        }
    }
    let refined = f64::midpoint(bracket[0], bracket[1]);
    let candidates = [best, refined].map(|range_m| (slope(range_m), range_m));
    if candidates[1].0 > candidates[0].0 { candidates[1] } else { candidates[0] }
}
