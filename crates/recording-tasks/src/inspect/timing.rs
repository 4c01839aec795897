//! Intervals between the messages of a stream: their rate, and where messages are missing.

use serde::Serialize;

/// Intervals whose median is the stream's: a minute and more of a fast unit. Later ones are judged by it as they come.
const FIRST_INTERVALS: usize = 4096;

/// From how many times the median on an interval lacks a message: half-way between one and two.
const GAP_RATIO: f64 = 1.5;

/// An interval in which messages are missing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Gap {
    /// When it begins, second since the earliest message of the recording.
    pub at_s: f64,
    /// How long it is.
    pub length_s: f64,
}

/// The intervals of a stream.
#[derive(Debug, Clone, Default)]
pub(super) struct Timing {
    last_ns: Option<i64>,
    /// The first intervals with their beginnings, until their median is taken.
    first: Vec<(i64, i64)>,
    median_ns: Option<i64>,
    pub gaps: u64,
    pub missing: u64,
    longest: Option<(i64, i64)>,
    pub not_ascending: u64,
}

impl Timing {
    pub fn add(&mut self, time_ns: i64) {
        let Some(last) = self.last_ns.replace(time_ns) else { return };
        let interval = time_ns.saturating_sub(last);
        if interval <= 0 {
            self.not_ascending += 1;
            // One that steps back by little is out of order: what follows is counted from the latest.
            self.last_ns = Some(time_ns.max(last));
            return;
        }
        if self.median_ns.is_some() {
            return self.judge(last, interval);
        }
        self.first.push((last, interval));
        if self.first.len() == FIRST_INTERVALS {
            self.take_median();
        }
    }

    /// The median of the first intervals; `None` where there are none.
    pub fn finish(&mut self) -> Option<i64> {
        if self.median_ns.is_none() {
            self.take_median();
        }
        self.median_ns
    }

    /// Beginning and length of the longest gap.
    pub fn longest_gap(&self, seconds: impl Fn(i64) -> f64) -> Option<Gap> {
        self.longest.map(|(at, length)| Gap { at_s: seconds(at), length_s: length as f64 * 1e-9 })
    }

    /// Of a stream without a rate of its own.
    pub fn forget_gaps(&mut self) {
        (self.gaps, self.missing, self.longest) = (0, 0, None);
    }

    fn take_median(&mut self) {
        let first = std::mem::take(&mut self.first);
        let mut lengths: Vec<i64> = first.iter().map(|(_, length)| *length).collect();
        lengths.sort_unstable();
        self.median_ns = lengths.get(lengths.len() / 2).copied();
        for (at, length) in first {
            self.judge(at, length);
        }
    }

    fn judge(&mut self, at: i64, length: i64) {
        let Some(median) = self.median_ns else { return };
        let ratio = length as f64 / median as f64;
        if ratio < GAP_RATIO {
            return;
        }
        self.gaps += 1;
        self.missing += (ratio.round() as u64).saturating_sub(1);
        if self.longest.is_none_or(|(_, longest)| length > longest) {
            self.longest = Some((at, length));
        }
    }
}
