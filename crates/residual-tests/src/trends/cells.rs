//! Square cells of neighbouring pixels of one frame, which may share errors.

use super::TrendSample;

/// Sides that are tried, in steps of the sampled pixels; the last are whole frames.
const SIDES: [Option<usize>; 7] = [Some(1), Some(2), Some(4), Some(8), Some(16), Some(32), None];

/// So many standard deviations from zero is the correlation of neighbouring cells where they are not independent. One
/// side is tested: what neighbours share makes it positive.
const SIGNIFICANT: f64 = 2.5;

/// Samples in cells.
pub(super) struct Cells {
    /// Side of a cell; `None` for whole frames.
    pub(super) side: Option<usize>,
    /// Frame, column and row of each cell, ascending.
    keys: Vec<[i64; 3]>,
    /// For each sample the position of its cell.
    pub(super) of_sample: Vec<usize>,
}

impl Cells {
    pub(super) fn sizes() -> impl Iterator<Item = Option<usize>> {
        SIDES.into_iter()
    }

    pub(super) fn new(samples: &[TrendSample], side: Option<usize>) -> Self {
        let steps = [step(samples.iter().map(|s| s.column)), step(samples.iter().map(|s| s.row))];
        let key = |sample: &TrendSample| {
            let place = |position: f64, step: f64| {
                side.map_or(0, |side| (position / (step * side as f64) + 1e-9).floor() as i64)
            };
            [sample.frame as i64, place(sample.column, steps[0]), place(sample.row, steps[1])]
        };
        let all: Vec<[i64; 3]> = samples.iter().map(key).collect();
        let mut keys = all.clone();
        keys.sort_unstable();
        keys.dedup();
        let of_sample = all.iter().map(|key| keys.binary_search(key).unwrap_or(0)).collect();
        // Cells as large as a frame are frames.
        let several = keys.windows(2).any(|pair| pair[0][0] == pair[1][0]);
        Self { side: side.filter(|_| several), keys, of_sample }
    }

    pub(super) fn count(&self) -> usize {
        self.keys.len()
    }

    /// Whether sums over the cells, each of unit variance, are not correlated with those of their neighbours. Whole
    /// frames have no neighbours.
    pub(super) fn are_independent(&self, sums: &[f64]) -> bool {
        if self.side.is_none() {
            return true;
        }
        let (mut products, mut squares, mut pairs) = (0.0, 0.0, 0_usize);
        for (index, [frame, column, row]) in self.keys.iter().enumerate() {
            for neighbour in [[*frame, column + 1, *row], [*frame, *column, row + 1]] {
                if let Ok(other) = self.keys.binary_search(&neighbour) {
                    products += sums[index] * sums[other];
                    squares += 0.5 * (sums[index].powi(2) + sums[other].powi(2));
                    pairs += 1;
                }
            }
        }
        pairs == 0 || squares == 0.0 || products / squares * (pairs as f64).sqrt() < SIGNIFICANT
    }
}

/// Smallest distance between two positions; 1 where there is only one.
fn step(positions: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = positions.collect();
    sorted.sort_by(f64::total_cmp);
    let gaps = sorted.windows(2).map(|pair| pair[1] - pair[0]).filter(|gap| *gap > 1e-6);
    let smallest = gaps.fold(f64::INFINITY, f64::min);
    if smallest.is_finite() { smallest } else { 1.0 }
}
