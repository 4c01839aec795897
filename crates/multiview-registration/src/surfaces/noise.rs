//! How points scatter along their rays, learnt from the patches of their station.
//!
//! Standard deviations that come with the points are scaled so that the points scatter about their patches as these say.
//! Where none come, they are a power of the range: noise grows with it by a law that differs from camera to camera, and
//! weights that follow another law cost precision.

use statistics::{Distribution, upper_median};

use crate::surfaces::grouping::POINTS_PER_PATCH;
use crate::surfaces::patches::{Patch, Surface};
use crate::surfaces::points::EDGE_ON;

/// Groups of patches of like range, each of which gives a median: patches across a crease are no plane.
const GROUPS: usize = 12;
/// Fewest patches of a group.
const FEWEST: usize = 8;
/// Least ratio of variances: surfaces without noise leave rounding.
const LEAST_RATIO: f64 = 1e-24;

/// Standard deviations, or a factor of them: `exp(level + power ln(range / centre))`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NoiseLaw {
    level: f64,
    power: f64,
    /// Logarithms of ranges: their mean, and between which the law is known.
    centre: f64,
    known: [f64; 2],
}

impl NoiseLaw {
    /// The factor of standard deviations of the points of the cloud, in any unit (NaN where nothing is said): one for all.
    pub(crate) fn scaling(said: &[f64], surface: &Surface) -> Self {
        Self::of_groups(ratios(said, surface), 1)
    }

    /// The standard deviations themselves, by the range.
    pub(crate) fn by_range(points: usize, surface: &Surface) -> Self {
        let ratios = ratios(&vec![1.0; points], surface);
        let groups = (ratios.len() / FEWEST).clamp(1, GROUPS);
        Self::of_groups(ratios, groups)
    }

    fn of_groups(mut ratios: Vec<(f64, f64)>, groups: usize) -> Self {
        ratios.sort_by(|a, b| a.0.total_cmp(&b.0));
        let medians = ratios.chunks(ratios.len().div_ceil(groups).max(1)).map(|group| {
            let median = |of: fn(&(f64, f64)) -> f64| upper_median(&mut group.iter().map(of).collect::<Vec<f64>>());
            (median(|r| r.0), median(|r| r.1))
        });
        Self::through(&medians.collect::<Vec<_>>())
    }

    /// The line through logarithms of ranges and of ratios of variances.
    fn through(medians: &[(f64, f64)]) -> Self {
        let n = medians.len().max(1) as f64;
        let centre = medians.iter().map(|m| m.0).sum::<f64>() / n;
        let level = medians.iter().map(|m| m.1).sum::<f64>() / n;
        let spread: f64 = medians.iter().map(|m| (m.0 - centre).powi(2)).sum();
        let slope = medians.iter().map(|m| (m.0 - centre) * (m.1 - level)).sum::<f64>() / spread;
        let power = if slope.is_finite() { 0.5 * slope } else { 0.0 };
        let known = [medians.first(), medians.last()].map(|end| end.map_or(centre, |m| m.0));
        Self { level: 0.5 * level, power, centre, known }
    }

    /// Factor at a range, metre; beyond the patches it stays as it is.
    pub fn factor(&self, range_m: f64) -> f64 {
        let at = range_m.ln().clamp(self.known[0], self.known[1]);
        (self.level + self.power * (at - self.centre)).exp()
    }
}

fn ratios(said: &[f64], surface: &Surface) -> Vec<(f64, f64)> {
    // Median over mean of what as many points as a patch is to have leave.
    let median_share = Distribution::ChiSquared { dof: POINTS_PER_PATCH }.quantile(0.5) / POINTS_PER_PATCH;
    let patches = surface.patches.iter().enumerate();
    patches.filter_map(|(index, patch)| ratio(said, surface.points_of(index), patch, median_share)).collect()
}

/// Logarithms of the range of a patch and of the ratio of variances along its rays, found to said.
fn ratio(said: &[f64], members: &[u32], patch: &Patch, median_share: f64) -> Option<(f64, f64)> {
    let range = patch.centre.coords.norm();
    let cosine = patch.normal.dot(&patch.centre.coords) / range;
    let (mut square, mut count) = (0.0, 0.0);
    for sigma in members.iter().map(|&i| said[i as usize]).filter(|sigma| !sigma.is_nan()) {
        square += sigma * sigma;
        count += 1.0;
    }
    let expected = square / count * (cosine * cosine + EDGE_ON) * median_share;
    let (at, ratio) = (range.ln(), (patch.point_variance / expected).max(LEAST_RATIO).ln());
    (at.is_finite() && ratio.is_finite()).then_some((at, ratio))
}

#[cfg(test)]
#[path = "../../tests/inside/noise.rs"]
mod tests;
