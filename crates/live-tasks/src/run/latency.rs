//! Latencies of a stream without end, in a table of fixed size.

use serde::Serialize;

/// Ratio of neighbouring cells: a quantile is right within a hundredth.
const RATIO: f64 = 1.01;
/// Upper end of the first cell, second.
const LEAST_S: f64 = 1e-6;
/// Cells, the last of which ends above a quarter of an hour: 1.01^2100 microseconds.
const CELLS: usize = 2100;

/// Latencies, from a frame that is there as a whole to its results.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct LatencySummary {
    /// Half of the frames took no longer, millisecond. Quantiles are right within a hundredth.
    pub p50_ms: f64,
    /// 95 of 100.
    pub p95_ms: f64,
    /// 99 of 100.
    pub p99_ms: f64,
    /// The longest.
    pub largest_ms: f64,
}

/// How many frames took how long.
#[derive(Debug)]
pub(super) struct Latencies {
    cells: Vec<u64>,
    count: u64,
    largest_s: f64,
}

impl Latencies {
    pub(super) fn new() -> Self {
        Self { cells: vec![0; CELLS], count: 0, largest_s: 0.0 }
    }

    pub(super) fn add(&mut self, seconds: f64) {
        let cell = ((seconds / LEAST_S).ln() / RATIO.ln()).ceil().clamp(0.0, (CELLS - 1) as f64);
        self.cells[cell as usize] += 1;
        self.count += 1;
        self.largest_s = self.largest_s.max(seconds);
    }

    pub(super) fn summary(&self) -> Option<LatencySummary> {
        (self.count > 0).then(|| LatencySummary {
            p50_ms: self.quantile_ms(0.5),
            p95_ms: self.quantile_ms(0.95),
            p99_ms: self.quantile_ms(0.99),
            largest_ms: 1e3 * self.largest_s,
        })
    }

    /// Upper end of the cell in which the quantile falls.
    fn quantile_ms(&self, share: f64) -> f64 {
        let rank = (share * self.count as f64).ceil() as u64;
        let mut below = 0;
        let reaches = |count: &u64| {
            below += count;
            below >= rank
        };
        let cell = self.cells.iter().position(reaches).unwrap_or(CELLS - 1);
        1e3 * (LEAST_S * RATIO.powi(cell as i32)).min(self.largest_s)
    }
}
