//! When a camera is warm.

use std::fmt;

use error_models::{RateHistory, Transient, WarmUp};

use crate::{DriftBlock, DriftResult};

/// Deviations that a value stays within. Of normal values three in a thousand lie outside.
const CERTAIN: f64 = 3.0;

/// From when on the ranges are stable, and how far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DriftVerdict {
    /// The modelled drift stays within the tolerance until the end.
    Stable {
        /// From this time since power-on on, second; the begin of the capture where it was stable already.
        after_s: f64,
        /// What block means deviate by at the end, three deviations and all that the model says remains, metre.
        within_m: f64,
    },
    /// At the end of the capture the modelled drift is larger than the tolerance.
    StillDrifts {
        /// When the model expects it to be within, second since power-on.
        expected_after_s: f64,
        /// The modelled drift at the end, metre.
        remaining_m: f64,
    },
}

impl fmt::Display for DriftVerdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stable { after_s, within_m } => {
                write!(f, "stable after {:.1} min, now within ±{:.2} mm", after_s / 60.0, 1e3 * within_m)
            }
            Self::StillDrifts { expected_after_s, remaining_m } => write!(
                f,
                "not yet stable: {:.2} mm remain, expected to be within the tolerance after {:.1} min",
                1e3 * remaining_m,
                expected_after_s / 60.0
            ),
        }
    }
}

/// Root mean square of the residuals in the last quarter of the capture, metre.
pub(crate) fn end_scatter_m(blocks: &[DriftBlock], residuals_m: &[f64]) -> f64 {
    let start_s = last_quarter_s(blocks);
    let last: Vec<f64> = blocks.iter().zip(residuals_m).filter(|(b, _)| b.time_s >= start_s).map(|(_, v)| *v).collect();
    (last.iter().map(|v| v * v).sum::<f64>() / last.len().max(1) as f64).sqrt()
}

fn last_quarter_s(blocks: &[DriftBlock]) -> f64 {
    let [first, last] = [blocks.first(), blocks.last()].map(|block| block.map_or(0.0, |block| block.time_s));
    last - 0.25 * (last - first)
}

pub(crate) fn default_tolerance_m(blocks: &[DriftBlock], residuals_m: &[f64]) -> f64 {
    CERTAIN * end_scatter_m(blocks, residuals_m)
}

/// The drift counts as what it is off from where it leads at the rate of the time: at that rate the camera is stable.
///
/// `scatter_m` is that of block means at the end, `warm_sigma_m` the standard deviation of the warm camera's mean.
pub(crate) fn judge(
    model: &WarmUp,
    rates: &RateHistory,
    blocks: &[DriftBlock],
    tolerance_m: f64,
    scatter_m: f64,
    warm_sigma_m: f64,
) -> DriftResult<DriftVerdict> {
    let [first, last] = [blocks.first(), blocks.last()].map(|block| block.map_or(0.0, |block| block.time_s));
    let after_s = settled_after_s(model, rates, tolerance_m, last).max(first);
    let drift = |block: &DriftBlock| {
        let value = model.value_at_rates(Some(block.time_s), block.temperature_c, Some(rates))?;
        Ok::<f64, error_models::Error>(value - model.frame_rate.map_or(0.0, |part| part.limit(block.time_s, rates)))
    };
    if after_s > last {
        let remaining_m = blocks.last().map_or(Ok(0.0), drift)?;
        return Ok(DriftVerdict::StillDrifts { expected_after_s: after_s, remaining_m });
    }
    let start_s = after_s.max(last_quarter_s(blocks));
    let mut remaining_m = 0.0_f64;
    for block in blocks.iter().filter(|block| block.time_s >= start_s) {
        remaining_m = remaining_m.max(drift(block)?.abs());
    }
    Ok(DriftVerdict::Stable { after_s, within_m: remaining_m + CERTAIN * scatter_m.hypot(warm_sigma_m) })
}

/// From when on transients, and the frame rate as it is followed, stay within the tolerance of where they lead.
fn settled_after_s(model: &WarmUp, rates: &RateHistory, tolerance_m: f64, last_s: f64) -> f64 {
    let Some(part) = model.frame_rate else { return model.settling_time_s(tolerance_m) };
    let mut end_s = f64::INFINITY;
    let begins = rates.steps(part.reference_hz).map(|(since_s, _)| since_s).filter(|since_s| *since_s < last_s);
    for begin_s in begins.collect::<Vec<_>>().into_iter().rev() {
        // Within a phase all that is left are exponentials from its begin on.
        let left = |part: &Transient| Transient { amplitude_m: part.value(begin_s), ..*part };
        let amplitude_m = part.value(begin_s, rates) - part.limit(begin_s, rates);
        let followed = Transient { amplitude_m, time_constant_s: part.time_constant_s };
        let transients = model.transients.iter().map(left).chain([followed]).collect();
        let settling_s = WarmUp { transients, ..WarmUp::default() }.settling_time_s(tolerance_m);
        if settling_s > 0.0 {
            return end_s.min(begin_s + settling_s);
        }
        end_s = begin_s;
    }
    0.0
}
