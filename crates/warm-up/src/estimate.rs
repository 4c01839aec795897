//! From samples to the model of the drift.

use error_models::{RateHistory, TemperatureDrift, Transient, WarmUp};
use nalgebra::DMatrix;

use crate::captures::blocks::block_means;
use crate::fit::{Fit, fit};
use crate::fitting::curve::{Curve, MOST_TRANSIENTS, RateSteps};
use crate::fitting::projection::Basis;
use crate::fitting::whitening::{Whitening, autocorrelation};
use crate::jump::refuse_jump;
use crate::rates::{CaptureRates, equalise_scatter};
use crate::transient_test::{FrameRateTest, TransientTest, test, test_rate};
use crate::verdict::{default_tolerance_m, end_scatter_m, judge};
use crate::{
    DriftBlock, DriftError, DriftOptions, DriftResult, DriftSample, DriftVerdict, TemperatureUse, captures::sample,
};

/// Spread of the temperature below which nothing can be said to follow it: a few steps of common sensors, kelvin.
const LEAST_SPREAD_K: f64 = 0.5;

/// The drift of a camera and how well it is known.
#[derive(Debug, Clone, PartialEq)]
pub struct DriftEstimate {
    /// The model; zero for the warm camera. Its span is that of the capture.
    pub model: WarmUp,
    /// Covariance of [`WarmUp::parameter_names`], scaled by sigma0².
    pub covariance: DMatrix<f64>,
    /// Mean change of the warm camera's ranges, metre: the constant that takes up the scene.
    pub warm_change_m: f64,
    /// Its standard deviation, metre.
    pub warm_change_sigma_m: f64,
    /// Correlation of neighbouring blocks that weights and covariance allow for.
    pub autocorrelation: f64,
    /// Standard deviation of unit weight: how much more blocks scatter than their samples' sigma says.
    pub sigma0: f64,
    /// Blocks less unknowns.
    pub redundancy: i64,
    /// Tests of one exponential more, from none on; the last one was not taken.
    pub tests: Vec<TransientTest>,
    /// The frame rates since power-on: that of the first frame counts from power-on on, unless others were stated.
    pub rates: RateHistory,
    /// Whether the drift follows the frame rate; `None` where there is one rate only, which does not tell.
    pub rate_test: Option<FrameRateTest>,
    /// The block means.
    pub blocks: Vec<DriftBlock>,
    /// Observed less modelled change of each, metre.
    pub residuals_m: Vec<f64>,
    /// Drift within which the camera counts as stable, metre.
    pub tolerance_m: f64,
    /// From when on it is.
    pub verdict: DriftVerdict,
}

impl DriftEstimate {
    /// Standard deviations of [`WarmUp::parameter_names`].
    pub fn deviations(&self) -> Vec<f64> {
        self.covariance.diagonal().iter().map(|variance| variance.sqrt()).collect()
    }

    /// Correlations of [`WarmUp::parameter_names`].
    pub fn correlation(&self) -> DMatrix<f64> {
        let deviations = self.deviations();
        DMatrix::from_fn(deviations.len(), deviations.len(), |i, j| {
            if i == j { 1.0 } else { self.covariance[(i, j)] / (deviations[i] * deviations[j]) }
        })
    }
}

/// Estimates the drift from mean changes of a scene at rest, one a frame, in the order of time (Sect. 4.7).
///
/// Means over blocks of equal length are fitted by a constant (the scene), none, one or two exponentials averaged over
/// each block, and a part that follows the temperature where that is asked for. One exponential more is taken where it
/// is significant at `options.level`, the search for its time constant allowed for (`[Hotelling1939]`). Neighbouring
/// blocks may be correlated: a first-order autoregressive process, estimated from the residuals, enters weights and
/// covariance (`[PraisWinsten1954]`); the covariance is scaled by sigma0².
///
/// Where the frame rate changes (Fig. 6), as the times of the frames show, a part that follows it
/// ([`error_models::FrameRateDrift`]) is taken by a test of the same kind. All else is then that of the rate of the first
/// frame, which counts from power-on on.
///
/// # Errors
/// A [`DriftError`] that names what the samples do not determine.
///
/// ```
/// use warm_up::{DriftOptions, DriftSample, DriftVerdict, estimate_drift};
///
/// // A mean change of range every ten seconds for an hour: 8 mm that fall off in 10 min, noise of 0.1 mm.
/// let sample = |k: i32| {
///     let time_s = 10.0 * f64::from(k);
///     let mean_change_m = 0.008 * (-time_s / 600.0).exp() + 1e-4 * (37.0 * f64::from(k)).sin();
///     DriftSample { time_s, mean_change_m, sigma_m: 1e-4, temperature_c: None }
/// };
/// let samples: Vec<DriftSample> = (0..360).map(sample).collect();
/// let drift = estimate_drift(&samples, &DriftOptions::default())?;
/// assert!(matches!(drift.verdict, DriftVerdict::Stable { .. }));
/// assert!((drift.model.transients[0].time_constant_s - 600.0).abs() < 10.0);
///
/// // Five minutes tell no time constant of ten.
/// assert!(estimate_drift(&samples[..30], &DriftOptions::default()).is_err());
/// # Ok::<(), warm_up::DriftError>(())
/// ```
pub fn estimate_drift(samples: &[DriftSample], options: &DriftOptions) -> DriftResult<DriftEstimate> {
    estimate(samples, None, options)
}

/// [`estimate_drift`] with the frame rates since power-on as they are stated, instead of those of the frames' times.
pub fn estimate_drift_at_rates(
    samples: &[DriftSample],
    rates: &RateHistory,
    options: &DriftOptions,
) -> DriftResult<DriftEstimate> {
    estimate(samples, Some(rates), options)
}

fn estimate(
    samples: &[DriftSample],
    stated: Option<&RateHistory>,
    options: &DriftOptions,
) -> DriftResult<DriftEstimate> {
    options.validate()?;
    sample::check(samples, options)?;
    let rates = CaptureRates::new(samples, stated)?;
    let (mut blocks, length_s) = block_means(samples, &rates.history, options)?;
    let reference_c = match options.temperature {
        TemperatureUse::Ignore => None,
        TemperatureUse::Estimate => Some(reference_temperature(&blocks)?),
    };
    // The time constant to start from comes with the test.
    let rate = rates.change().then_some(RateSteps { steps: &rates.steps, start_s: length_s });
    if rates.change() {
        equalise_scatter(&mut blocks, &rates, |blocks| Curve { blocks, length_s, reference_c, rate }.scatter());
    }
    let mut curve = Curve { blocks: &blocks, length_s, reference_c, rate };
    refuse_jump(&curve)?;
    let mut rate_test = follow_rate(&mut curve, options)?;
    let (chosen, tests) = choose_resolved(&mut curve, &mut rate_test, options)?;
    let autocorrelation = chosen.autocorrelation(&curve);
    require_explained(autocorrelation, options)?;
    let whitening = Whitening::new(&blocks, length_s, autocorrelation);
    let adjusted = fit(&curve, chosen.transients, &whitening)?;
    curve.require_decayed(&adjusted)?;
    curve.require_followed(&adjusted, &rates)?;
    finish(&curve, adjusted, (autocorrelation, tests, rate_test), samples, &rates, options)
}

/// Tests whether the drift follows the frame rate, beside transients of any time constants; the curve keeps the part that
/// does only where it is significant.
fn follow_rate(curve: &mut Curve<'_>, options: &DriftOptions) -> DriftResult<Option<FrameRateTest>> {
    let Some(rate) = curve.rate.take() else { return Ok(None) };
    let whitening = Curve { rate: Some(rate), ..curve.clone() }.flexible_whitening(options)?;
    let found = test_rate(curve, &rate, &whitening, &curve.flexible(&whitening), options.level);
    let start_s = found.time_constant_s.filter(|_| found.taken);
    curve.rate = start_s.map(|start_s| RateSteps { start_s, ..rate });
    Ok(Some(found))
}

/// Mean of the last tenth of the blocks.
fn reference_temperature(blocks: &[DriftBlock]) -> DriftResult<f64> {
    let temperatures: Vec<f64> = blocks.iter().filter_map(|block| block.temperature_c).collect();
    let (low, high) = temperatures.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| (a.min(*t), b.max(*t)));
    let spread_k = high - low;
    if spread_k < LEAST_SPREAD_K {
        return Err(DriftError::TemperatureConstant { spread_k, needed_k: LEAST_SPREAD_K });
    }
    let last = &temperatures[temperatures.len() - (temperatures.len() / 10).max(1)..];
    Ok(last.iter().sum::<f64>() / last.len() as f64)
}

/// The number of exponentials. A part that follows the frame rate, and cannot be told beside exponentials that can be told
/// without it, is given up: chance has made it.
fn choose_resolved(
    curve: &mut Curve<'_>,
    rate_test: &mut Option<FrameRateTest>,
    options: &DriftOptions,
) -> DriftResult<(Fit, Vec<TransientTest>)> {
    let lacks = |(fit, tests): &(Fit, Vec<TransientTest>)| {
        fit.transients < MOST_TRANSIENTS && tests.last().is_some_and(|last| last.p_value < options.level)
    };
    let chosen = choose(curve, options);
    let unresolved = chosen.as_ref().map_or_else(DriftError::is_unresolved, lacks);
    if curve.rate.is_none() || !unresolved {
        return chosen;
    }
    let without = Curve { rate: None, ..curve.clone() };
    match choose(&without, options) {
        Ok(found) if !lacks(&found) && found.0.autocorrelation(&without) <= options.largest_autocorrelation => {
            curve.rate = None;
            *rate_test = rate_test.map(|test| FrameRateTest { taken: false, ..test });
            Ok(found)
        }
        _ => chosen,
    }
}

/// The number of exponentials, each tested at the level.
///
/// All fits and tests share the serial correlation that a curve of fixed exponentials leaves: what a model lacks must
/// not be taken for noise.
fn choose(curve: &Curve<'_>, options: &DriftOptions) -> DriftResult<(Fit, Vec<TransientTest>)> {
    let whitening = curve.flexible_whitening(options)?;
    let mut tests = Vec::new();
    let mut chosen = fit(curve, 0, &whitening)?;
    loop {
        let residuals = whitening.column(chosen.residuals_m.iter().copied());
        let found = test(curve, &whitening, &chosen.basis(curve, &whitening), residuals, chosen.transients);
        let more = if found.p_value < options.level && chosen.transients < MOST_TRANSIENTS {
            fit_if_resolved(curve, chosen.transients + 1, &whitening)?
        } else {
            None
        };
        tests.push(TransientTest { taken: more.is_some(), ..found });
        match more {
            Some(more) => chosen = more,
            None => return Ok((chosen, tests)),
        }
    }
}

/// A fit whose time constants are longer than a block; `None` where amplitude and time constant of one cannot be told
/// apart.
fn fit_if_resolved(curve: &Curve<'_>, transients: usize, whitening: &Whitening) -> DriftResult<Option<Fit>> {
    match fit(curve, transients, whitening) {
        Ok(fit) => Ok(Some(fit).filter(|fit| fit.transients().all(|(_, tau)| tau > curve.length_s))),
        Err(error) if error.is_unresolved() => Ok(None),
        Err(error) => Err(error),
    }
}

fn require_explained(autocorrelation: f64, options: &DriftOptions) -> DriftResult<()> {
    let limit = options.largest_autocorrelation;
    if autocorrelation > limit { Err(DriftError::NotExplained { autocorrelation, limit }) } else { Ok(()) }
}

impl Curve<'_> {
    /// The serial correlation beside a curve that follows any drift.
    fn flexible_whitening(&self, options: &DriftOptions) -> DriftResult<Whitening> {
        let plain = Whitening::new(self.blocks, self.length_s, 0.0);
        let flexible: Basis = self.flexible(&plain);
        let correlation = autocorrelation(&flexible.residual(plain.column(self.observed())), flexible.rank());
        require_explained(correlation, options)?;
        Ok(Whitening::new(self.blocks, self.length_s, correlation))
    }

    /// Refuses a time constant that the capture is too short for: what it leads to is not seen.
    pub(crate) fn require_longer_than(&self, time_constant_s: f64) -> DriftResult<()> {
        let (duration_s, needed_s) = (self.duration_s() + self.length_s, WarmUp::DECAYED * time_constant_s);
        if duration_s < needed_s {
            return Err(DriftError::ShorterThanTimeConstant { duration_s, time_constant_s, needed_s });
        }
        Ok(())
    }

    fn require_decayed(&self, fit: &Fit) -> DriftResult<()> {
        fit.transients().try_for_each(|(_, time_constant_s)| self.require_longer_than(time_constant_s))
    }
}

/// What the choice of the model found: serial correlation, tests of exponentials and of the frame rate.
type Found = (f64, Vec<TransientTest>, Option<FrameRateTest>);

/// The model of a fit, with the deviations of its own parameters.
fn finish(
    curve: &Curve<'_>,
    fit: Fit,
    (autocorrelation, tests, rate_test): Found,
    samples: &[DriftSample],
    rates: &CaptureRates,
    options: &DriftOptions,
) -> DriftResult<DriftEstimate> {
    let (model, jacobian) = parameters(curve, &fit, samples, rates)?;
    let (blocks, residuals_m) = (curve.blocks.to_vec(), fit.residuals_m);
    let tolerance_m = options.tolerance_m.unwrap_or_else(|| default_tolerance_m(&blocks, &residuals_m));
    let warm_change_sigma_m = fit.covariance[(0, 0)].sqrt();
    let scatter_m = end_scatter_m(&blocks, &residuals_m);
    Ok(DriftEstimate {
        verdict: judge(&model, &rates.history, &blocks, tolerance_m, scatter_m, warm_change_sigma_m)?,
        model,
        covariance: &jacobian * fit.covariance * jacobian.transpose(),
        warm_change_m: fit.unknowns[0],
        warm_change_sigma_m,
        autocorrelation,
        sigma0: fit.sigma0,
        redundancy: fit.redundancy,
        tests,
        rates: rates.history.clone(),
        rate_test,
        blocks,
        residuals_m,
        tolerance_m,
    })
}

/// The model, and the derivatives of its parameters by the unknowns of the fit.
fn parameters(
    curve: &Curve<'_>,
    fit: &Fit,
    samples: &[DriftSample],
    rates: &CaptureRates,
) -> DriftResult<(WarmUp, DMatrix<f64>)> {
    let (start_s, count) = (curve.start_s(), fit.unknowns.len());
    let mut order: Vec<(usize, (f64, f64))> = fit.transients().enumerate().collect();
    order.sort_by(|a, b| a.1.1.total_cmp(&b.1.1));
    // Derivatives of A and tau by a and ln tau, A = a exp(start / tau).
    let (mut model, mut rows) = (WarmUp::default(), Vec::new());
    let row = |values: &[(usize, f64)]| {
        let mut row = vec![0.0; count];
        for (place, value) in values {
            row[*place] = *value;
        }
        row
    };
    for (place, (amplitude_m, time_constant_s)) in order {
        let growth = (start_s / time_constant_s).exp();
        let by_logarithm = -amplitude_m * growth * start_s / time_constant_s;
        rows.push(row(&[(1 + 2 * place, growth), (2 + 2 * place, by_logarithm)]));
        rows.push(row(&[(2 + 2 * place, time_constant_s)]));
        model.transients.push(Transient { amplitude_m: amplitude_m * growth, time_constant_s });
    }
    let span = |values: &mut dyn Iterator<Item = f64>| {
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)])
    };
    if let Some(reference_c) = curve.reference_c {
        let place = 1 + 2 * fit.transients;
        let span_c = Some(span(&mut samples.iter().filter_map(|sample| sample.temperature_c)));
        let coefficient_m_per_k = fit.unknowns[place];
        model.temperature = Some(TemperatureDrift { coefficient_m_per_k, reference_c, span_c });
        rows.push(row(&[(place, 1.0)]));
    }
    if let Some((coefficient_m_per_hz, time_constant_s)) = fit.frame_rate() {
        model.frame_rate = Some(rates.drift(coefficient_m_per_hz, time_constant_s));
        rows.extend([row(&[(count - 2, 1.0)]), row(&[(count - 1, time_constant_s)])]);
    }
    model.time_span_s = Some(span(&mut samples.iter().map(|sample| sample.time_s)));
    model.validate()?;
    Ok((model, DMatrix::from_fn(rows.len(), count, |i, j| rows[i][j])))
}
