//! By how much noise is larger than stated.

use statistics::Distribution;

/// Least factor of the noise of all points that is believed. Simulated rooms whose noise is as stated have 0.83 to 0.95, and up to 1.32
/// where what is common to frames is not taken off; frames of a Kinect have 1.7 to 2.7.
const NOISIER: f64 = 1.44;
/// Ratio of the noise within frames below which less is there than stated: simulated rooms whose noise is as stated have 0.91, frames of a
/// Kinect 0.64 to 0.80, both a quarter of that where it is stated twice as large.
const SMALLER: f64 = 0.5;

/// The factor that is believed: one where it is not known to be larger.
pub(crate) fn if_larger(ratio: f64) -> f64 {
    if ratio > NOISIER { ratio } else { 1.0 }
}

/// Whether noise is clearly smaller than stated.
pub(crate) fn is_smaller(ratio: f64) -> bool {
    ratio < SMALLER
}

/// By how many times weighted squares are larger than their degrees of freedom say, both given: the quantile of `share` of their ratios to that
/// of chi-squared, each counting by its degrees of freedom, so that all others may be of something else. One where there are none.
pub(crate) fn noise_ratio(squares: impl Iterator<Item = (f64, f64)>, share: f64) -> f64 {
    let ratio = |(sum, dof): (f64, f64)| (sum / Distribution::ChiSquared { dof }.quantile(share), dof);
    let mut ratios: Vec<(f64, f64)> = squares.filter(|(_, dof)| *dof > 0.0).map(ratio).collect();
    ratios.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let least = share * ratios.iter().map(|(_, dof)| dof).sum::<f64>();
    let mut below = 0.0;
    let found = ratios.iter().find(|(_, dof)| {
        below += dof;
        below >= least
    });
    found.map_or(1.0, |(ratio, _)| *ratio)
}
