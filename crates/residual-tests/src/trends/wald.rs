//! Means in bins of one variable against the covariance that independent cells show.

use nalgebra::{DMatrix, DVector};
use statistics::Distribution;

use super::cells::Cells;
use super::{TrendBin, TrendSample};

/// Below, there is no curve to be told.
pub(super) const FEWEST_BINS: usize = 3;

/// Each bin needs so many independent cells for each bin that there is: the covariance of the means comes from their
/// scatter.
const CELLS_PER_BIN: usize = 3;

/// The samples in bins of equal numbers.
pub(super) struct Binned {
    of_sample: Vec<usize>,
    weights: Vec<f64>,
    sums: Vec<f64>,
    spans: Vec<[f64; 2]>,
    counts: Vec<usize>,
}

/// What the test found.
pub(super) struct BinnedTest {
    pub(super) p_value: f64,
    pub(super) rms_m: f64,
    pub(super) errors_m: Vec<f64>,
    pub(super) cell: Option<usize>,
}

impl Binned {
    /// `None` where the values do not fill three bins.
    pub(super) fn new(samples: &[TrendSample], values: &[f64], bins: usize) -> Option<Self> {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        // Lower ends of all bins but the first; equal values stay together.
        let mut edges: Vec<f64> = (1..bins).map(|bin| sorted[bin * sorted.len() / bins]).collect();
        edges.retain(|edge| *edge > sorted[0]);
        edges.dedup();
        let count = edges.len() + 1;
        if count < FEWEST_BINS {
            return None;
        }
        let of_sample: Vec<usize> = values.iter().map(|value| edges.partition_point(|edge| edge <= value)).collect();
        let mut binned = Self {
            weights: vec![0.0; count],
            sums: vec![0.0; count],
            spans: vec![[f64::INFINITY, f64::NEG_INFINITY]; count],
            counts: vec![0; count],
            of_sample: Vec::new(),
        };
        for ((sample, value), &bin) in samples.iter().zip(values).zip(&of_sample) {
            let weight = sample.sigma_m.powi(-2);
            binned.weights[bin] += weight;
            binned.sums[bin] += weight * sample.residual_m;
            binned.counts[bin] += 1;
            let [low, high] = binned.spans[bin];
            binned.spans[bin] = [low.min(*value), high.max(*value)];
        }
        binned.of_sample = of_sample;
        Some(binned)
    }

    fn mean(&self, bin: usize) -> f64 {
        self.sums[bin] / self.weights[bin]
    }

    /// Tests with these cells; `None` where they are not independent or too few.
    pub(super) fn test_with(&self, samples: &[TrendSample], cells: &Cells) -> Option<BinnedTest> {
        let count = self.weights.len();
        // Of each cell its sum with unit variance; of each cell and bin its weight and its share in the mean.
        let (mut weight, mut sums) = (vec![0.0; cells.count()], vec![0.0; cells.count()]);
        let (mut weights, mut shares) = (vec![0.0; cells.count() * count], vec![0.0; cells.count() * count]);
        for ((sample, &bin), &cell) in samples.iter().zip(&self.of_sample).zip(&cells.of_sample) {
            let (w, rest) = (sample.sigma_m.powi(-2), sample.residual_m - self.mean(bin));
            weight[cell] += w;
            sums[cell] += w * rest;
            weights[cell * count + bin] += w / self.weights[bin];
            shares[cell * count + bin] += w * rest / self.weights[bin];
        }
        let independent = fewest_cells(&weights, count);
        sums.iter_mut().zip(&weight).for_each(|(sum, weight)| *sum /= weight.sqrt());
        if independent < (CELLS_PER_BIN * count) as f64 || !cells.are_independent(&sums) {
            return None;
        }
        // How far each mean moves without the cell: what a cell itself pulls the mean by is not hidden.
        shares.iter_mut().zip(&weights).for_each(|(share, weight)| *share /= 1.0 - weight);
        let mut covariance = DMatrix::zeros(count, count);
        for share in shares.chunks_exact(count) {
            for (i, left) in share.iter().enumerate().filter(|(_, left)| **left != 0.0) {
                share.iter().enumerate().for_each(|(j, right)| covariance[(i, j)] += left * right);
            }
        }
        let p_value = self.hotelling(&covariance, independent)?;
        let errors_m: Vec<f64> = covariance.diagonal().iter().map(|variance| variance.sqrt()).collect();
        Some(BinnedTest { p_value, rms_m: self.rms(&errors_m), errors_m, cell: cells.side })
    }

    /// Differences of the means to the last one, all zero without a trend.
    fn hotelling(&self, covariance: &DMatrix<f64>, independent: f64) -> Option<f64> {
        let last = self.weights.len() - 1;
        let difference = DVector::from_fn(last, |i, _| self.mean(i) - self.mean(last));
        let of_difference = DMatrix::from_fn(last, last, |i, j| {
            covariance[(i, j)] - covariance[(i, last)] - covariance[(last, j)] + covariance[(last, last)]
        });
        let square = difference.dot(&of_difference.cholesky()?.solve(&difference));
        let (p, n) = (last as f64, independent);
        let statistic = square * (n - p) / (p * (n - 1.0));
        let p_value = Distribution::Fisher { numerator: p, denominator: n - p }.p_value(statistic);
        Some(p_value).filter(|p_value| p_value.is_finite())
    }

    /// Scatter of the means about their common mean, less that of chance.
    fn rms(&self, errors_m: &[f64]) -> f64 {
        let count = self.weights.len() as f64;
        let common = self.sums.iter().sum::<f64>() / self.weights.iter().sum::<f64>();
        let squares: f64 =
            (0..errors_m.len()).map(|bin| (self.mean(bin) - common).powi(2) - errors_m[bin].powi(2)).sum();
        (squares / count).max(0.0).sqrt()
    }

    pub(super) fn bins(&self, errors_m: &[f64]) -> Vec<TrendBin> {
        let bin = |(index, error): (usize, &f64)| TrendBin {
            low: self.spans[index][0],
            high: self.spans[index][1],
            mean_m: self.mean(index),
            standard_error_m: *error,
            samples: self.counts[index],
        };
        errors_m.iter().enumerate().map(bin).collect()
    }
}

/// Number of cells of equal weight that would know a mean as well, in the bin that has the fewest.
fn fewest_cells(weights: &[f64], bins: usize) -> f64 {
    let mut squares = vec![0.0; bins];
    for of_cell in weights.chunks_exact(bins) {
        squares.iter_mut().zip(of_cell).for_each(|(square, weight)| *square += weight * weight);
    }
    squares.into_iter().fold(f64::INFINITY, |fewest, square| fewest.min(1.0 / square))
}
