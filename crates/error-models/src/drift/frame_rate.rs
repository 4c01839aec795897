//! Drift that follows the frame rate: the work load warms the camera (Sect. 4.7, Fig. 6).

use crate::error::{require_finite, require_span};
use crate::{Error, RateHistory, Result, WarmUp};

/// The part of a drift that follows the frame rate f, behind it: `τ u̇ = c (f(t) − f_ref) − u`.
///
/// It is zero at power-on and at the reference rate: the transients of a [`WarmUp`] and the offset d0 of a calibration are
/// those of a camera that runs at `f_ref` from power-on on. For a linear system that is exact, whatever rate it starts
/// with: a rate other than `f_ref` is a further input, and begins when the camera is switched on. For rates `f_k` since
/// `s_k` (`s_0 = 0`, `f_(−1) = f_ref`): `u(t) = c Σ (f_k − f_(k−1)) (1 − exp(−(t − s_k) / τ))`, `s_k ≤ t`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct FrameRateDrift {
    /// c, by how much ranges change in the end, metre per hertz.
    pub coefficient_m_per_hz: f64,
    /// τ, the time in which the camera follows, second.
    pub time_constant_s: f64,
    /// `f_ref`, the rate that transients and d0 belong to, hertz.
    pub reference_hz: f64,
    /// Rates it was fitted in, hertz; `None` where it holds at all.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub span_hz: Option<[f64; 2]>,
}

/// Share of a response that may be unknown: what is left of a transient that counts as decayed.
const NEGLIGIBLE: f64 = 0.05;

/// Part of the width of a span that rates may lie outside of it: those of frames are not exact.
const BEYOND_SPAN: f64 = 0.1;

impl FrameRateDrift {
    /// u at a time since power-on, metre.
    pub fn value(&self, time_s: f64, rates: &RateHistory) -> f64 {
        self.coefficient_m_per_hz * self.response(time_s, rates)[0]
    }

    /// `∂` of [`Self::value`] by c and τ.
    pub fn jacobian(&self, time_s: f64, rates: &RateHistory) -> [f64; 2] {
        let [response_hz, by_time_constant] = self.response(time_s, rates);
        [response_hz, self.coefficient_m_per_hz * by_time_constant]
    }

    /// What u tends to at the rate of a time, metre.
    pub fn limit(&self, time_s: f64, rates: &RateHistory) -> f64 {
        self.coefficient_m_per_hz * (rates.rate_hz(time_s) - self.reference_hz)
    }

    /// The rate as the camera follows it, less the reference, hertz, and its derivative by τ.
    fn response(&self, time_s: f64, rates: &RateHistory) -> [f64; 2] {
        let past = rates.steps(self.reference_hz).take_while(|(since_s, _)| *since_s <= time_s);
        past.fold([0.0; 2], |[response, slope], (since_s, step)| {
            let x = (time_s - since_s) / self.time_constant_s;
            [response - step * (-x).exp_m1(), slope - step * x * (-x).exp() / self.time_constant_s]
        })
    }

    /// Standard deviation that stretches of unknown rate leave of the value, metre: any rate of the span is as likely.
    /// Zero without a span.
    pub fn unknown_sigma_m(&self, time_s: f64, rates: &RateHistory) -> f64 {
        let width = self.span_hz.map_or(0.0, |span| span[1] - span[0]);
        let share: f64 = rates.unknown().iter().map(|stretch| self.share(*stretch, time_s)).sum();
        (self.coefficient_m_per_hz * width * share).abs() / 12.0_f64.sqrt()
    }

    /// Share of the response at a time that a stretch of time before it has.
    fn share(&self, [from_s, to_s]: [f64; 2], time_s: f64) -> f64 {
        let left = |since_s: f64| (-(time_s - since_s.min(time_s)) / self.time_constant_s).exp();
        left(to_s) - left(from_s)
    }

    /// Refuses a time whose response rests on rates that are not known, or on rates outside the span.
    pub(crate) fn require(&self, time_s: f64, rates: &RateHistory) -> Result<()> {
        let stretches = rates.unknown().iter().map(|stretch| (self.share(*stretch, time_s), *stretch));
        let share: f64 = stretches.clone().map(|(share, _)| share).sum();
        let largest = stretches.max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, [from_s, to_s])) = largest.filter(|_| share > NEGLIGIBLE) {
            return Err(Error::UnknownFrameRate { from_s, to_s });
        }
        let Some(span) = self.span_hz else { return Ok(()) };
        let beyond = BEYOND_SPAN * (span[1] - span[0]);
        let phases = rates.phases();
        let outside = phases.iter().enumerate().filter(|(_, phase)| {
            !(phase.rate_hz >= span[0] - beyond && phase.rate_hz <= span[1] + beyond) && phase.since_s <= time_s
        });
        let share = |index: usize| {
            let end_s = phases.get(index + 1).map_or(f64::INFINITY, |next| next.since_s);
            self.share([if index == 0 { 0.0 } else { phases[index].since_s }, end_s], time_s)
        };
        let shares = outside.map(|(index, phase)| (share(index), phase.rate_hz));
        let sum: f64 = shares.clone().map(|(share, _)| share).sum();
        match shares.max_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((_, value)) if sum > NEGLIGIBLE => {
                Err(Error::OutsideDriftSpan { name: "frame rate", unit: "Hz", value, span })
            }
            _ => Ok(()),
        }
    }

    pub(crate) fn validate(&self) -> Result<()> {
        require_finite("coefficient_m_per_hz", self.coefficient_m_per_hz)?;
        crate::drift::warm_up::require_time_constant(self.time_constant_s)?;
        require_finite("reference_hz", self.reference_hz)?;
        self.span_hz.map_or(Ok(()), |span| require_span("span_hz", span))
    }
}

impl WarmUp {
    /// [`Self::value`] of a camera whose frame rates are known.
    ///
    /// # Errors
    /// As of [`Self::value`]; [`Error::UnknownFrameRate`] and [`Error::OutsideDriftSpan`] where more than 5 % of the
    /// response to the frame rate rest on rates that are not known or outside the span, a tenth of its width beyond either
    /// end not counted; [`Error::MissingForDrift`] where the model follows the frame rate and there are no rates.
    pub fn value_at_rates(
        &self,
        time_s: Option<f64>,
        temperature_c: Option<f64>,
        rates: Option<&RateHistory>,
    ) -> Result<f64> {
        let others = self.value_without_rate(time_s, temperature_c)?;
        Ok(others + self.rate_arguments(time_s, rates)?.map_or(0.0, |(part, time_s, rates)| part.value(time_s, rates)))
    }

    /// `∂` of [`Self::value_at_rates`] by [`Self::parameter_names`], with its errors.
    pub fn jacobian_at_rates(
        &self,
        time_s: Option<f64>,
        temperature_c: Option<f64>,
        rates: Option<&RateHistory>,
    ) -> Result<Vec<f64>> {
        let mut row = self.jacobian_without_rate(time_s, temperature_c)?;
        if let Some((part, time_s, rates)) = self.rate_arguments(time_s, rates)? {
            row.extend(part.jacobian(time_s, rates));
        }
        Ok(row)
    }

    /// What the part that follows the frame rate needs; `None` where there is none.
    fn rate_arguments<'a>(
        &self,
        time_s: Option<f64>,
        rates: Option<&'a RateHistory>,
    ) -> Result<Option<(FrameRateDrift, f64, &'a RateHistory)>> {
        let Some(part) = self.frame_rate else { return Ok(None) };
        let time_s = time_s.ok_or(Error::MissingForDrift { name: "time since power-on" })?;
        if !(time_s.is_finite() && time_s >= 0.0) {
            let (name, unit, span) = ("time since power-on", "s", [0.0, f64::INFINITY]);
            return Err(Error::OutsideDriftSpan { name, unit, value: time_s, span });
        }
        let rates = rates.ok_or(Error::MissingForDrift { name: "frame rate since power-on" })?;
        part.require(time_s, rates)?;
        Ok(Some((part, time_s, rates)))
    }
}
