//! Start values of the amplitude hyperbola (Eq. 15) from what a calibration without it leaves over.

use error_models::AmplitudeHyperbola;
use range_calibration::{hyperbola_gain, hyperbola_start};
use statistics::Distribution;

use crate::{CalibrationOutcome, Component, Network, Result, Verdict};

/// Probability that residuals which do not depend on the amplitude are taken for a hyperbola's. It only decides whether one
/// is tried, which takes as long as all the rest.
const WORTH_TRYING: f64 = 0.05;

/// The network with start values for h1, h2, h3, from the residuals of its ranges against their amplitudes.
///
/// # Errors
/// [`range_calibration::Error::NoHyperbola`] where the residuals show none.
pub(crate) fn with_hyperbola(network: &Network, without: &CalibrationOutcome) -> Result<Network> {
    let mut samples = samples(without);
    let amplitude_span =
        samples.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], (a, _)| [low.min(*a), high.max(*a)]);
    let [h1, h2, h3] = hyperbola_start(&mut samples, amplitude_span)?;
    let mut found = network.clone();
    found.range_model.hyperbola = Some(AmplitudeHyperbola { h1, h2, h3, amplitude_span });
    Ok(found)
}

/// Whether the hyperbola that a network starts from fits what a calibration without one leaves over significantly better
/// than none.
pub(crate) fn is_worth_trying(network: &Network, without: &CalibrationOutcome) -> bool {
    let least = Distribution::ChiSquared { dof: 3.0 }.critical(WORTH_TRYING);
    network.range_model.hyperbola.is_some_and(|hyperbola| hyperbola_gain(&mut samples(without), &hyperbola) > least)
}

/// Amplitudes and residuals of the ranges.
fn samples(without: &CalibrationOutcome) -> Vec<(f64, f64)> {
    let ranges = without.residuals.iter().filter(|quality| {
        let used = matches!(quality.verdict, Verdict::Used | Verdict::Uncontrolled | Verdict::Rejected);
        quality.component == Component::Range && quality.amplitude.is_finite() && used
    });
    ranges.map(|quality| (quality.amplitude, quality.residual)).collect()
}
