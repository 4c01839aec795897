//! Means over blocks of equal length: a fit of them takes milliseconds, however many frames there are.

use error_models::RateHistory;

use crate::options::DriftOptions;
use crate::{DriftError, DriftResult, DriftSample};

/// The mean of the samples of one stretch of time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriftBlock {
    /// Mean time since power-on, second.
    pub time_s: f64,
    /// Half of the time that it stands for, second: √3 times the standard deviation of its times, so that an
    /// exponential is averaged as the samples average it.
    pub half_width_s: f64,
    /// Weighted mean of the changes, metre.
    pub change_m: f64,
    /// Standard deviation from those of the samples, metre; where the frame rate changes, scaled for each phase to how
    /// much its blocks scatter.
    pub sigma_m: f64,
    /// Mean temperature, degree Celsius, where all its samples have one.
    pub temperature_c: Option<f64>,
    /// Number of samples.
    pub samples: usize,
}

/// Means over about `options.blocks` blocks, and their common length, second; stretches without samples have none.
///
/// No block reaches over a change of the frame rate: each phase is divided into blocks of nearly the common length.
pub(crate) fn block_means(
    samples: &[DriftSample],
    rates: &RateHistory,
    options: &DriftOptions,
) -> DriftResult<(Vec<DriftBlock>, f64)> {
    let needed = DriftOptions::LEAST_BLOCKS;
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else {
        return Err(DriftError::TooFewBlocks { blocks: 0, needed });
    };
    let count = options.blocks.min(samples.len());
    let length_s = (last.time_s - first.time_s) / count as f64;
    let changes = rates.phases().iter().map(|phase| phase.since_s);
    let inside = changes.filter(|since_s| *since_s > first.time_s && *since_s <= last.time_s);
    let ends: Vec<f64> = inside.chain([last.time_s]).collect();
    let (mut blocks, mut start, mut rest) = (Vec::with_capacity(count + ends.len()), first.time_s, samples);
    for (place, &end) in ends.iter().enumerate() {
        let own = if place + 1 == ends.len() { rest.len() } else { rest.partition_point(|one| one.time_s < end) };
        let (phase, later) = rest.split_at(own);
        let parts = ((end - start) / length_s).round().max(1.0);
        let number = |sample: &DriftSample| ((sample.time_s - start) / (end - start) * parts).min(parts - 1.0) as usize;
        blocks.extend(phase.chunk_by(|a, b| number(a) == number(b)).map(mean));
        (start, rest) = (end, later);
    }
    if blocks.len() < needed {
        return Err(DriftError::TooFewBlocks { blocks: blocks.len(), needed });
    }
    Ok((blocks, length_s))
}

fn mean(samples: &[DriftSample]) -> DriftBlock {
    let weight = |sample: &DriftSample| sample.sigma_m.powi(-2);
    let weights: f64 = samples.iter().map(weight).sum();
    let mean =
        |of: &dyn Fn(&DriftSample) -> f64| samples.iter().map(|one| weight(one) * of(one)).sum::<f64>() / weights;
    let time_s = mean(&|sample| sample.time_s);
    let temperatures = samples.iter().all(|sample| sample.temperature_c.is_some());
    DriftBlock {
        time_s,
        half_width_s: (3.0 * mean(&|sample| (sample.time_s - time_s).powi(2))).sqrt(),
        change_m: mean(&|sample| sample.mean_change_m),
        sigma_m: weights.sqrt().recip(),
        temperature_c: temperatures.then(|| mean(&|sample| sample.temperature_c.unwrap_or(f64::NAN))),
        samples: samples.len(),
    }
}
