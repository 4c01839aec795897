//! The drifts of two calibrations of a warming camera, with the band that their covariances leave.

use error_models::{RateHistory, WarmUp};
use nalgebra::DMatrix;

use super::correction::{intersection, linear};
use super::{deviation, estimated, require_covariance, require_level, simultaneous_factor};
use crate::Result;

/// Times, temperatures and frame rates that the drifts are compared at.
const TIMES: usize = 96;
const TEMPERATURES: usize = 5;
const RATES: usize = 3;

/// Without a span a drift is compared for so many of its longest time constants, so many kelvin about its reference, and
/// from standstill to so many times its reference rate.
const TIME_CONSTANTS: f64 = 5.0;
const KELVIN: f64 = 10.0;
const REFERENCES: f64 = 2.0;

/// A drift with the covariance of its parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct DriftSide<'a> {
    /// The drift.
    pub model: &'a WarmUp,
    /// Covariance by [`WarmUp::parameter_names`].
    pub covariance: DMatrix<f64>,
}

/// The difference of two drifts at a time, a temperature and a frame rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriftDifference {
    /// Time since power-on, second; `None` where neither drift depends on it.
    pub time_s: Option<f64>,
    /// Temperature, degree Celsius; `None` where neither drift depends on it.
    pub temperature_c: Option<f64>,
    /// Frame rate since power-on, hertz; `None` where neither drift depends on it.
    pub rate_hz: Option<f64>,
    /// Drift of the second minus that of the first, metre.
    pub difference_m: f64,
    /// Half the width of the band that holds everywhere at once, metre.
    pub band_m: f64,
}

/// How far apart two drifts are.
#[derive(Debug, Clone, PartialEq)]
pub struct DriftComparison {
    /// Where the magnitude of the difference is largest.
    pub largest: DriftDifference,
    /// Where it is largest in units of its band.
    pub clearest: DriftDifference,
    /// Root mean square of the difference over times, temperatures and frame rates, metre.
    pub rms_m: f64,
    /// The difference along the time at a medium temperature and frame rate; one value where neither depends on the time.
    pub along_time: Vec<DriftDifference>,
    /// Whether the difference leaves its band anywhere.
    pub significant: bool,
}

/// Compares two drifts over the times, temperatures and frame rates (each from power-on on) that both were fitted in, which
/// they may be even where one has more exponentials than the other, or alone follows the frame rate. The band holds everywhere at once `[Scheffe1953]`.
///
/// # Errors
/// [`Error::NotComparable`](crate::Error::NotComparable) where the spans have nothing in common;
/// [`Error::OutOfDomain`](crate::Error::OutOfDomain) for covariance and level.
pub fn compare_drifts(first: &DriftSide<'_>, second: &DriftSide<'_>, level: f64) -> Result<DriftComparison> {
    require_level(level)?;
    let names = [first, second].map(|side| side.model.parameter_names());
    for (side, names) in [first, second].into_iter().zip(&names) {
        require_covariance(&side.covariance, names.len())?;
    }
    let free = estimated([(&names[0], &first.covariance), (&names[1], &second.covariance)]);
    let factor = simultaneous_factor(free, level);
    let times = grid(times([first.model, second.model])?, TIMES);
    let temperatures = grid(temperatures([first.model, second.model])?, TEMPERATURES);
    let rates = grid(frame_rates([first.model, second.model])?, RATES);
    let (medium, medium_hz) = (temperatures[temperatures.len() / 2], rates[rates.len() / 2]);
    let mut all = Vec::with_capacity(times.len() * temperatures.len() * rates.len());
    for &rate_hz in &rates {
        let history = rate_hz.map(RateHistory::constant).transpose()?;
        for &temperature_c in &temperatures {
            for &time_s in &times {
                let at = |side: &DriftSide<'_>| -> Result<[f64; 2]> {
                    let gradient = side.model.jacobian_at_rates(time_s, temperature_c, history.as_ref())?;
                    let value = side.model.value_at_rates(time_s, temperature_c, history.as_ref())?;
                    Ok([value, deviation(&side.covariance, &gradient)])
                };
                let (one, other) = (at(first)?, at(second)?);
                let (difference_m, band_m) = (other[0] - one[0], factor * one[1].hypot(other[1]));
                all.push(DriftDifference { time_s, temperature_c, rate_hz, difference_m, band_m });
            }
        }
    }
    let best = |value: fn(&DriftDifference) -> f64| {
        all.iter().copied().fold(all[0], |best, here| if value(&here) > value(&best) { here } else { best })
    };
    let (largest, clearest) = (best(|here| here.difference_m.abs()), best(DriftDifference::clarity));
    let squares: f64 = all.iter().map(|here| here.difference_m.powi(2)).sum();
    Ok(DriftComparison {
        largest,
        clearest,
        rms_m: (squares / all.len() as f64).sqrt(),
        significant: clearest.clarity() > 1.0,
        along_time: all.into_iter().filter(|here| (here.temperature_c, here.rate_hz) == (medium, medium_hz)).collect(),
    })
}

impl DriftDifference {
    /// The difference in units of its band; without a band any difference is infinite.
    fn clarity(&self) -> f64 {
        /// What rounding leaves of equal drifts, metre.
        const ROUNDING_M: f64 = 1e-12;
        if self.difference_m.abs() <= ROUNDING_M { 0.0 } else { self.difference_m.abs() / self.band_m }
    }
}

/// Times that both drifts know; `None` where neither asks for one.
fn times(models: [&WarmUp; 2]) -> Result<Option<[f64; 2]>> {
    let longest = models.iter().filter_map(|model| model.longest_time_constant_s()).max_by(f64::total_cmp);
    let Some(longest) = longest else { return Ok(None) };
    let asking = models.into_iter().filter(|model| !model.transients.is_empty() || model.frame_rate.is_some());
    let known: Vec<[f64; 2]> = asking.filter_map(|model| model.time_span_s).collect();
    if known.is_empty() {
        return Ok(Some([0.0, TIME_CONSTANTS * longest]));
    }
    intersection("times", known.into_iter()).map(Some)
}

/// Temperatures that both drifts know; `None` where neither asks for one.
fn temperatures(models: [&WarmUp; 2]) -> Result<Option<[f64; 2]>> {
    let parts: Vec<_> = models.iter().filter_map(|model| model.temperature).collect();
    let Some(first) = parts.first() else { return Ok(None) };
    let known: Vec<[f64; 2]> = parts.iter().filter_map(|part| part.span_c).collect();
    if known.is_empty() {
        return Ok(Some([first.reference_c - KELVIN, first.reference_c + KELVIN]));
    }
    intersection("temperatures", known.into_iter()).map(Some)
}

/// Frame rates that both drifts know; `None` where neither asks for one.
fn frame_rates(models: [&WarmUp; 2]) -> Result<Option<[f64; 2]>> {
    let parts: Vec<_> = models.iter().filter_map(|model| model.frame_rate).collect();
    let Some(first) = parts.first() else { return Ok(None) };
    let known: Vec<[f64; 2]> = parts.iter().filter_map(|part| part.span_hz).collect();
    if known.is_empty() {
        return Ok(Some([0.0, REFERENCES * first.reference_hz]));
    }
    intersection("frame rates", known.into_iter()).map(Some)
}

fn grid(span: Option<[f64; 2]>, count: usize) -> Vec<Option<f64>> {
    span.map_or_else(|| vec![None], |span| linear(span, count).into_iter().map(Some).collect())
}
