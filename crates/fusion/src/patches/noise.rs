//! By how much noise is larger than stated.

use statistics::Distribution;

/// Least factor of the noise of all points that is believed. Simulated rooms whose noise is as stated have 0.83 to 0.95, and up to 1.32
/// where what is common to frames is not taken off; frames of a Kinect have 1.7 to 2.7.
const NOISIER: f64 = 1.44;

/// By how many times weighted squares are larger than their degrees of freedom say, both given: the quantile of `share` of their ratios to that
/// of chi-squared, each counting by its degrees of freedom, so that all others may be of something else. One below [`NOISIER`].
pub(crate) fn noise_factor(squares: impl Iterator<Item = (f64, f64)>, share: f64) -> f64 {
    let ratio = |(sum, dof): (f64, f64)| (sum / Distribution::ChiSquared { dof }.quantile(share), dof);
    let mut ratios: Vec<(f64, f64)> = squares.filter(|(_, dof)| *dof > 0.0).map(ratio).collect();
    ratios.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let least = share * ratios.iter().map(|(_, dof)| dof).sum::<f64>();
    let mut below = 0.0;
    let found = ratios.iter().find(|(_, dof)| {
        below += dof;
        below >= least
    });
    found.map(|(ratio, _)| *ratio).filter(|ratio| *ratio > NOISIER).unwrap_or(1.0)
}
