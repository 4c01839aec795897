//! The entry: a network in, its calibration or the reason for none out.

use crate::methods::problem::Problem;
use crate::{CalibrationOptions, CalibrationOutcome, Error, Method, Network, Result};

/// Calibrates a range camera from a network of targets.
///
/// Start values are found where there are none. Terms of a list may be words for several:
///
/// | word | terms | instead of |
/// |---|---|---|
/// | `splineN` | periodic spline with N knots over the ambiguity interval, s0 on | d2 to d7 |
/// | `polynomialN` | polynomial of order N over the observed ranges, q1 on | |
/// | `surfaceN` | surface of order N over the image, g10 on | e1, e2 |
///
/// The methods:
///
/// | method | unknown together | then |
/// |---|---|---|
/// | one step | lens, range terms, poses, targets | |
/// | two steps, dependent | lens, poses, targets from image points | range terms from the distances between the adjusted stations and targets, whose full covariance is handed on |
/// | joint, two steps | the same with the image points of a passive camera and its relative orientation | the same |
/// | joint, integrated | lens, range terms, poses, targets, relative orientation | |
/// | laboratory | range terms from known distances, or known poses and coordinates, with their deviations | |
///
/// Image points alone have no scale. Where neither control nor a known distance gives it, the second step estimates it
/// from the ranges, as one more unknown beside the range terms.
///
/// # Errors
/// Whatever is wrong with the network, by name; [`NetworkError::WeakNetwork`](crate::NetworkError::WeakNetwork) where it does not determine the parameters, with
/// what to add; [`Error::MethodNeeds`] where the method asks for something else (two networks:
/// [`calibrate_two_networks`]).
pub fn calibrate(network: &Network, options: &CalibrationOptions) -> Result<CalibrationOutcome> {
    network.validate()?;
    options.check(network)?;
    Problem { network, lens: None, options, robust: false }.judged()
}

/// Calibrates in two independent steps: the lens from the image points of one network, the range terms from another,
/// whose stations are oriented by resection from independently known targets: coordinates with their deviations.
///
/// Lens and covariance of the first network are handed on to the resection, and the covariance of lens and poses to the
/// range terms. Targets of the second network need coordinates with a covariance. The datum
/// of the options is that of the first network. The image points of the second improve the lens as well.
///
/// # Errors
/// As [`calibrate`].
pub fn calibrate_two_networks(
    lens: &Network,
    range: &Network,
    options: &CalibrationOptions,
) -> Result<CalibrationOutcome> {
    if options.method != Method::TwoStepIndependent {
        let needs = "it takes one network; two are for the two-step independent method".to_owned();
        return Err(Error::MethodNeeds { method: options.method.name().to_owned(), needs });
    }
    lens.validate()?;
    range.validate()?;
    options.check(range)?;
    Problem { network: range, lens: Some(lens), options, robust: false }.judged()
}
