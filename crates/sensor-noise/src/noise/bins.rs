//! Variances averaged over values of like light.

use statistics::{Distribution, upper_median};

use super::fit::{Line, VarianceEstimator};
use super::repeats::Repeats;

/// Averages of values whose regressor (light, one over the squared amplitude) is alike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VarianceBin {
    /// Mean of the regressor.
    pub regressor: f64,
    /// Mean of the variances.
    pub variance: f64,
    /// Degrees of freedom of that mean.
    pub degrees: f64,
    /// Values that were averaged.
    pub values: usize,
}

/// A pixel whose variance noise exceeds as rarely as this has moved.
const MOVED_PROBABILITY: f64 = 1e-5;

/// Repeats sorted by their regressor and cut into classes of equal number.
pub(super) struct Classes {
    sorted: Vec<Repeats>,
    length: usize,
}

impl Classes {
    /// Fewer classes than asked for where they would hold fewer than 20 values each.
    pub(super) fn new(mut repeats: Vec<Repeats>, bins: usize) -> Self {
        repeats.sort_by(|a, b| a.regressor.total_cmp(&b.regressor));
        let bins = bins.min(repeats.len() / 20).max(3);
        let length = repeats.len().div_ceil(bins).max(1);
        Self { sorted: repeats, length }
    }

    /// Without the classes whose usual variance is larger.
    pub(super) fn below(mut self, estimator: VarianceEstimator, largest: f64) -> Self {
        if largest.is_finite() {
            let small = |class: &[Repeats]| usual_variance(class, estimator) <= largest;
            let is_small: Vec<bool> = self.sorted.chunks(self.length).map(small).collect();
            let mut places = 0..self.sorted.len();
            self.sorted.retain(|_| places.next().is_some_and(|place| is_small[place / self.length]));
        }
        self
    }

    pub(super) fn len(&self) -> usize {
        self.sorted.len()
    }

    pub(super) fn all(&self) -> &[Repeats] {
        &self.sorted
    }

    /// Without the values that this line expects to scatter more. Single ones: a class that holds lost pixels spans decades.
    pub(super) fn expected_below(self, line: &Line, largest: f64, bins: usize) -> Self {
        if largest.is_infinite() {
            return self;
        }
        let mut sorted = self.sorted;
        sorted.retain(|one| line.at(one.regressor) <= largest);
        Self::new(sorted, bins)
    }

    /// Mean variances of what noise around the median of its class explains, at the middle regressor, which lost pixels do
    /// not spoil: for a start.
    pub(super) fn around_medians(&self, estimator: VarianceEstimator) -> Vec<VarianceBin> {
        let mut bins = Vec::new();
        for class in self.sorted.chunks(self.length) {
            let (median, before) = (usual_variance(class, estimator), bins.len());
            average(&mut bins, class, estimator, |_| median, |_| false);
            for bin in &mut bins[before..] {
                bin.regressor = class[class.len() / 2].regressor;
            }
        }
        bins
    }

    /// Mean variances of what noise around the line explains, and the number of values left out.
    pub(super) fn around_line(&self, estimator: VarianceEstimator, line: &Line) -> (Vec<VarianceBin>, usize) {
        let (mut bins, mut moved) = (Vec::new(), 0);
        let pixels = self.moved_pixels(estimator, line);
        for class in self.sorted.chunks(self.length) {
            moved += average(&mut bins, class, estimator, |one| line.at(one.regressor), |one| pixels[one.pixel]);
        }
        (bins, moved)
    }

    /// By pixel, whether all of its values together scatter more than noise does: each alone may hide what moved where light
    /// and with it the change is little.
    fn moved_pixels(&self, estimator: VarianceEstimator, line: &Line) -> Vec<bool> {
        let pixels = self.sorted.iter().map(|one| one.pixel + 1).max().unwrap_or(0);
        let mut sums = vec![[0.0; 2]; pixels];
        for one in &self.sorted {
            let degrees = estimator.degrees(one.count);
            let [scatter, all] = &mut sums[one.pixel];
            *scatter += degrees * estimator.variance(one) / line.at(one.regressor);
            *all += degrees;
        }
        let mut limits = MovedLimits::default();
        sums.iter().map(|[scatter, all]| *all > 0.0 && has_moved(*scatter, *all, limits.of(*all))).collect()
    }
}

/// Whether a variance is more than noise of the expected variance shows.
pub(super) fn has_moved(variance: f64, expected: f64, limit: f64) -> bool {
    variance > limit * expected
}

/// Largest variance over its expectation that noise shows.
pub(super) fn moved_limit(degrees: f64) -> f64 {
    Distribution::ChiSquared { dof: degrees }.upper_quantile(MOVED_PROBABILITY) / degrees
}

/// [`moved_limit`] of the few degrees of freedom that stations and pixels have between them.
#[derive(Default)]
pub(super) struct MovedLimits(Vec<(f64, f64)>);

impl MovedLimits {
    pub(super) fn of(&mut self, degrees: f64) -> f64 {
        if let Some((_, limit)) = self.0.iter().find(|(of, _)| of.to_bits() == degrees.to_bits()) {
            return *limit;
        }
        self.0.push((degrees, moved_limit(degrees)));
        moved_limit(degrees)
    }
}

/// The variance of a class from the median of its variances.
fn usual_variance(class: &[Repeats], estimator: VarianceEstimator) -> f64 {
    let mut known: Vec<(usize, f64)> = Vec::new();
    let scaled = |one: &Repeats| {
        let share = known.iter().find(|(count, _)| *count == one.count).map(|(_, share)| *share);
        let share = share.unwrap_or_else(|| {
            known.push((one.count, median_share(estimator.degrees(one.count))));
            median_share(estimator.degrees(one.count))
        });
        estimator.variance(one) / share
    };
    let mut scaled: Vec<f64> = class.iter().map(scaled).collect();
    upper_median(&mut scaled)
}

/// Median of a variance over its expectation.
fn median_share(degrees: f64) -> f64 {
    Distribution::ChiSquared { dof: degrees }.quantile(0.5) / degrees
}

/// Appends the mean over a class, if anything is left of it; the number of values left out.
fn average(
    bins: &mut Vec<VarianceBin>,
    class: &[Repeats],
    estimator: VarianceEstimator,
    expected: impl Fn(&Repeats) -> f64,
    of_moved_pixel: impl Fn(&Repeats) -> bool,
) -> usize {
    let mut bin = VarianceBin { regressor: 0.0, variance: 0.0, degrees: 0.0, values: 0 };
    let mut limits = MovedLimits::default();
    for one in class {
        let degrees = estimator.degrees(one.count);
        let variance = estimator.variance(one);
        if of_moved_pixel(one) || has_moved(variance, expected(one), limits.of(degrees)) {
            continue;
        }
        bin.regressor += degrees * one.regressor;
        bin.variance += degrees * variance;
        bin.degrees += degrees;
        bin.values += 1;
    }
    if bin.values > 0 {
        bin.regressor /= bin.degrees;
        bin.variance /= bin.degrees;
        bins.push(bin);
    }
    class.len() - bin.values
}
