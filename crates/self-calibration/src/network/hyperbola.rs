//! Start values of the amplitude hyperbola (Eq. 15) from what a calibration without it leaves over.

use error_models::AmplitudeHyperbola;

use super::{CalibrationOutcome, Component, Network, Verdict};
use crate::Result;
use crate::hyperbola_start::hyperbola_start;

/// The network with start values for h1, h2, h3, from the residuals of its ranges against their amplitudes.
///
/// # Errors
/// [`crate::Error::NoHyperbola`] where the residuals show none.
pub(crate) fn with_hyperbola(network: &Network, without: &CalibrationOutcome) -> Result<Network> {
    let ranges = without.residuals.iter().filter(|quality| {
        let used = matches!(quality.verdict, Verdict::Used | Verdict::Uncontrolled | Verdict::Rejected);
        quality.component == Component::Range && quality.amplitude.is_finite() && used
    });
    let mut samples: Vec<(f64, f64)> = ranges.map(|quality| (quality.amplitude, quality.residual)).collect();
    let span =
        samples.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], (a, _)| [low.min(*a), high.max(*a)]);
    let [h1, h2, h3] = hyperbola_start(&mut samples, span)?;
    let mut found = network.clone();
    found.range_model.hyperbola = Some(AmplitudeHyperbola { h1, h2, h3, amplitude_span: span });
    Ok(found)
}
