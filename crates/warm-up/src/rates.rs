//! The frame rates of a capture: its phases, and what they determine of a drift that follows them.

use error_models::{FrameRateDrift, RateHistory, WarmUp};

use crate::fit::Fit;
use crate::fitting::curve::{Curve, RateSteps};
use crate::fitting::whitening::Whitening;
use crate::{DriftBlock, DriftError, DriftResult, DriftSample};

/// Part of a capture that its longest stretch of unknown rate may have. A choice: a minute of an hour.
const LARGEST_GAP: f64 = 1.0 / 60.0;

/// Share of the response to the frame rate that may rest on unknown rates.
const LARGEST_UNKNOWN: f64 = 0.05;

/// Redundancy of a phase from which on its own scatter is told. A standard deviation from so many is known to a fifth.
const LEAST_REDUNDANCY: f64 = 10.0;

/// The frame rates of a capture.
#[derive(Debug)]
pub(crate) struct CaptureRates {
    pub(crate) history: RateHistory,
    /// That of the first frame, which transients and the warm camera's mean belong to.
    pub(crate) reference_hz: f64,
    /// Smallest and largest during the capture.
    pub(crate) span_hz: [f64; 2],
    pub(crate) steps: Vec<(f64, f64)>,
}

impl CaptureRates {
    /// Rates as stated, or those of the samples' own times. Refuses stretches of unknown rate.
    pub(crate) fn new(samples: &[DriftSample], stated: Option<&RateHistory>) -> DriftResult<Self> {
        let (first_s, last_s) =
            (samples.first().map_or(0.0, |one| one.time_s), samples.last().map_or(0.0, |one| one.time_s));
        let of_frames = || {
            let times: Vec<f64> = samples.iter().map(|sample| sample.time_s).collect();
            RateHistory::of_frames(&times, first_s)
        };
        let history = stated.map_or_else(of_frames, |stated| Ok(stated.clone()))?;
        let during = |stretch: &&[f64; 2]| stretch[1].min(last_s) - stretch[0].max(first_s);
        let longest = history.unknown().iter().max_by(|a, b| during(a).total_cmp(&during(b)));
        if let Some([from_s, to_s]) = longest.copied().filter(|gap| during(&gap) > LARGEST_GAP * (last_s - first_s)) {
            return Err(DriftError::FrameRateUnknown { from_s, to_s });
        }
        let reference_hz = history.rate_hz(first_s);
        let inside = history.phases().iter().filter(|phase| phase.since_s > first_s && phase.since_s <= last_s);
        let span_hz =
            inside.fold([reference_hz; 2], |[low, high], phase| [low.min(phase.rate_hz), high.max(phase.rate_hz)]);
        let steps = history.steps(reference_hz).collect();
        Ok(Self { history, reference_hz, span_hz, steps })
    }

    /// Whether the rate changes during the capture: only then a drift can be seen to follow it.
    pub(crate) fn change(&self) -> bool {
        self.span_hz[0] < self.span_hz[1]
    }

    /// The model of an adjusted coefficient and time constant.
    pub(crate) fn drift(&self, coefficient_m_per_hz: f64, time_constant_s: f64) -> FrameRateDrift {
        let (reference_hz, span_hz) = (self.reference_hz, Some(self.span_hz));
        FrameRateDrift { coefficient_m_per_hz, time_constant_s, reference_hz, span_hz }
    }

    /// The phase of a block.
    fn phase(&self, block: &DriftBlock) -> usize {
        self.history.phases().partition_point(|phase| phase.since_s <= block.time_s).max(1) - 1
    }
}

/// Gives the blocks of each phase the standard deviation that they scatter by: frames at a high rate are averaged by the
/// hundred, which does not make errors smaller that they share.
///
/// The scatter is that about a curve that follows any drift; blocks that rule it scatter less, which their leverage says.
pub(crate) fn equalise_scatter(
    blocks: &mut [DriftBlock],
    rates: &CaptureRates,
    mut curve: impl FnMut(&[DriftBlock]) -> (Vec<f64>, Vec<f64>),
) {
    // The weights change the curve, and the scatter with it, by little.
    for _ in 0..2 {
        let (residuals, leverages) = curve(blocks);
        let mut sums = vec![(0.0, 0.0); rates.history.phases().len()];
        for ((block, residual), leverage) in blocks.iter().zip(&residuals).zip(&leverages) {
            let sum: &mut (f64, f64) = &mut sums[rates.phase(block)];
            *sum = (sum.0 + residual * residual, sum.1 + 1.0 - leverage);
        }
        let (squares, redundancy) = sums.iter().fold((0.0, 0.0), |all, sum| (all.0 + sum.0, all.1 + sum.1));
        for block in blocks.iter_mut() {
            let own = sums[rates.phase(block)];
            let (squares, redundancy) = if own.1 < LEAST_REDUNDANCY { (squares, redundancy) } else { own };
            if squares > 0.0 {
                block.sigma_m *= (squares / redundancy).sqrt();
            }
        }
    }
}

impl Curve<'_> {
    /// Whitened residuals of the curve that follows any drift, and the leverage of each block on it.
    pub(crate) fn scatter(&self) -> (Vec<f64>, Vec<f64>) {
        let plain = Whitening::new(self.blocks, self.length_s, 0.0);
        let flexible = self.flexible(&plain);
        (flexible.residual(plain.column(self.observed())), flexible.leverages(self.blocks.len()))
    }

    /// Refuses a time constant that all phases behind a change of the rate are too short for.
    pub(crate) fn require_phase_longer_than(&self, rate: &RateSteps<'_>, time_constant_s: f64) -> DriftResult<()> {
        let end_s = self.start_s() + self.duration_s() + 0.5 * self.length_s;
        let ends = rate.steps.iter().skip(1).map(|(since_s, _)| *since_s).chain([end_s]);
        let behind = rate.steps.iter().zip(ends).filter(|((since_s, _), _)| *since_s > self.start_s());
        let phase_s = behind.map(|((since_s, _), to_s)| to_s.min(end_s) - since_s).fold(0.0, f64::max);
        let needed_s = WarmUp::DECAYED * time_constant_s;
        if phase_s < needed_s {
            return Err(DriftError::PhaseTooShort { phase_s, time_constant_s, needed_s });
        }
        Ok(())
    }

    /// Refuses a fit that follows the frame rate faster than a block, or slower than its phases show, or by rates that
    /// nothing says.
    pub(crate) fn require_followed(&self, fit: &Fit, rates: &CaptureRates) -> DriftResult<()> {
        let (Some(rate), Some((_, time_constant_s))) = (&self.rate, fit.frame_rate()) else { return Ok(()) };
        if time_constant_s < self.length_s {
            return Err(DriftError::FasterThanBlock { time_constant_s, block_s: self.length_s });
        }
        self.require_phase_longer_than(rate, time_constant_s)?;
        let stretches = rates.history.unknown().iter().filter(|stretch| stretch[1] > self.start_s());
        let share = |stretch: &[f64; 2]| -((stretch[0] - stretch[1]) / time_constant_s).exp_m1();
        match stretches.max_by(|a, b| share(a).total_cmp(&share(b))) {
            Some(gap) if share(gap) > LARGEST_UNKNOWN => {
                Err(DriftError::FrameRateUnknown { from_s: gap[0], to_s: gap[1] })
            }
            _ => Ok(()),
        }
    }
}
