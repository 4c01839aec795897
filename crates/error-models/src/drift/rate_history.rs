//! How fast a camera took frames since it was switched on.

use statistics::upper_median;

use crate::error::require_finite;
use crate::{Error, Result};

/// A frame rate that holds until the next one.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct RatePhase {
    /// From when on, second.
    pub since_s: f64,
    /// Frames a second; 0 for a camera that is on and takes none.
    pub rate_hz: f64,
}

/// The frame rate since power-on, piecewise constant.
#[derive(Debug, Clone, PartialEq)]
pub struct RateHistory {
    phases: Vec<RatePhase>,
    unknown: Vec<[f64; 2]>,
}

/// Ratio below which two frame rates count as one: clocks and exposures vary, and lost frames are none of the work load.
const SAME_RATE: f64 = 1.25;

/// Intervals that the rate at a frame is the median of, so that single lost frames do not matter.
const WINDOW: usize = 11;

/// Intervals that a rate must last for to be one.
const LEAST_RUN: usize = WINDOW / 2 + 1;

/// Ratio to the median of their phase up to which intervals make up its rate: two are a lost frame.
const NEAR: f64 = 1.5;

/// An interval so many times that of its phase is no lost frame: what the camera did meanwhile is not known.
const GAP: f64 = 3.0;

impl RateHistory {
    /// Frames that tell a rate. Fewer leave the median to lost frames.
    pub const LEAST_FRAMES: usize = WINDOW;

    /// Rates as they are stated, times in second since power-on. What is before the first one is not known.
    ///
    /// # Errors
    /// [`Error::OutOfDomain`] for no rates, times that do not ascend, and values that are negative or not finite.
    pub fn new(phases: Vec<RatePhase>) -> Result<Self> {
        let bad = |name, value, expected| Err(Error::OutOfDomain { name, value, expected });
        for phase in &phases {
            require_finite("since_s of a frame rate", phase.since_s)?;
            if !(phase.rate_hz.is_finite() && phase.rate_hz >= 0.0) {
                return bad("rate_hz", phase.rate_hz, "a frame rate is finite and not negative");
            }
        }
        if let Some(pair) = phases.windows(2).find(|pair| pair[1].since_s <= pair[0].since_s) {
            return bad("since_s of a frame rate", pair[1].since_s, "it is after that of the rate before");
        }
        let Some(first) = phases.first() else {
            return bad("number of frame rates", 0.0, "there is at least one");
        };
        let unknown = if first.since_s > 0.0 { vec![[0.0, first.since_s]] } else { Vec::new() };
        Ok(Self { phases, unknown })
    }

    /// One rate from power-on on.
    pub fn constant(rate_hz: f64) -> Result<Self> {
        Self::new(vec![RatePhase { since_s: 0.0, rate_hz }])
    }

    /// The rates of a stream from the times of its frames, second since power-on, ascending.
    ///
    /// The rate changes where the median of eleven intervals does, by a ratio of 1.25, for six intervals at least, and the
    /// mean with it. It is
    /// not known in intervals of more than three times those of their phase, nor between `known_from_s` and a first
    /// frame after it; until `known_from_s` the first rate counts.
    ///
    /// # Errors
    /// [`Error::NoFrameStream`] for fewer than eleven frames; [`Error::OutOfDomain`] for times that do not ascend.
    pub fn of_frames(times_s: &[f64], known_from_s: f64) -> Result<Self> {
        if times_s.len() < Self::LEAST_FRAMES {
            return Err(Error::NoFrameStream { frames: times_s.len(), needed: Self::LEAST_FRAMES });
        }
        let intervals: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        if let Some(value) = intervals.iter().copied().find(|interval| !(interval.is_finite() && *interval > 0.0)) {
            let expected = "times of frames are finite and ascend";
            return Err(Error::OutOfDomain { name: "time between two frames", value, expected });
        }
        let mut unknown = Vec::new();
        if times_s[0] > known_from_s {
            unknown.push([known_from_s.max(0.0), times_s[0]]);
        }
        let mut runs: Vec<Run> = Vec::new();
        for run in runs_of(&intervals) {
            let gaps = (run.start..run.end).filter(|index| intervals[*index] > GAP * run.middle_s);
            unknown.extend(gaps.map(|index| [times_s[index], times_s[index + 1]]));
            match runs.last_mut().filter(|before| ratio(before.rate_hz(), run.rate_hz()) <= SAME_RATE) {
                // Jitter makes medians differ, not means.
                Some(before) => (before.sum_s, before.count) = (before.sum_s + run.sum_s, before.count + run.count),
                None => runs.push(run),
            }
        }
        let since_s = |run: &Run| if run.start == 0 { 0.0 } else { times_s[run.start] };
        let phases = runs.iter().map(|run| RatePhase { since_s: since_s(run), rate_hz: run.rate_hz() }).collect();
        Ok(Self { phases, unknown })
    }

    /// The rates; the first one counts from power-on on.
    pub fn phases(&self) -> &[RatePhase] {
        &self.phases
    }

    /// Begin and end of the stretches in which the rate is not known but assumed to be that of the phase.
    pub fn unknown(&self) -> &[[f64; 2]] {
        &self.unknown
    }

    /// The rate at a time.
    pub fn rate_hz(&self, time_s: f64) -> f64 {
        let later = self.phases.partition_point(|phase| phase.since_s <= time_s);
        self.phases[later.saturating_sub(1)].rate_hz
    }

    /// Times at which the rate changes, and by how much, from a reference on: `(0, f_0 − reference)` first.
    pub fn steps(&self, reference_hz: f64) -> impl Iterator<Item = (f64, f64)> {
        let before = std::iter::once(reference_hz).chain(self.phases.iter().map(|phase| phase.rate_hz));
        let since = |index: usize, phase: &RatePhase| if index == 0 { 0.0 } else { phase.since_s };
        let steps = self.phases.iter().zip(before).enumerate();
        steps.map(move |(index, (phase, before))| (since(index, phase), phase.rate_hz - before))
    }
}

fn ratio(a: f64, b: f64) -> f64 {
    a.max(b) / a.min(b)
}

/// Intervals of one rate.
struct Run {
    start: usize,
    end: usize,
    middle_s: f64,
    /// Sum and number of those near the median: lost frames are left out.
    sum_s: f64,
    count: f64,
}

impl Run {
    fn rate_hz(&self) -> f64 {
        self.count / self.sum_s
    }
}

fn runs_of(intervals: &[f64]) -> Vec<Run> {
    let starts = starts(intervals);
    let ends = starts[1..].iter().copied().chain([intervals.len()]);
    let run = |(start, end): (usize, usize)| {
        let own = &intervals[start..end];
        let middle_s = upper_median(&mut own.to_vec());
        let regular = own.iter().filter(|interval| ratio(**interval, middle_s) <= NEAR);
        let (sum_s, count) = regular.fold((0.0, 0.0), |(sum, count), interval| (sum + interval, count + 1.0));
        Run { start, end, middle_s, sum_s, count }
    };
    starts.iter().copied().zip(ends).map(run).collect()
}

/// The first interval of each run of medians that differ from those before.
fn starts(intervals: &[f64]) -> Vec<usize> {
    let half = WINDOW / 2;
    let mut window = [0.0; WINDOW];
    let mut local = Vec::with_capacity(intervals.len());
    for index in 0..intervals.len() {
        let around = &intervals[index.saturating_sub(half)..intervals.len().min(index + half + 1)];
        window[..around.len()].copy_from_slice(around);
        local.push(upper_median(&mut window[..around.len()]));
    }
    let (mut starts, mut level) = (vec![0], local[0]);
    for index in 1..local.len() {
        let run = local.get(index..index + LEAST_RUN).unwrap_or(&[]);
        let lasts = !run.is_empty() && run.iter().all(|interval| ratio(*interval, local[index]) <= SAME_RATE);
        if lasts && ratio(local[index], level) > SAME_RATE {
            starts.push(index);
            level = local[index];
        }
    }
    starts
}
