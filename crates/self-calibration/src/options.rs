//! How a network is calibrated.

use std::collections::BTreeMap;

use calibration_network::functional_model::{Datum, usual_sigmas};

use crate::{Network, NetworkError, Result};

/// The methods of Sect. 5.3.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Lens, range terms, poses and object points in one adjustment.
    OneStep,
    /// Lens from one network of image points, range terms from reference ranges of another facility.
    TwoStepIndependent,
    /// Lens and poses from the image points, then range terms from the reference ranges that these give.
    TwoStepDependent,
    /// With a passive camera: its poses carry the range camera's, then range terms from reference ranges.
    JointTwoStep,
    /// With a passive camera in one adjustment, the relative orientation being one unknown for all epochs.
    JointIntegrated,
    /// Range terms from distances known from outside (a track or a baseline).
    Laboratory,
}

/// Which terms are estimated.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum TermSelection {
    /// All, each with what cameras show of it as an observation of zero: waves and tilt of the range error with a standard
    /// deviation of 2 cm, radial lens terms of 20, 10, 5 % and decentring ones of 1 % of the corner's radius, b1 and b2 of
    /// 0.001. A hyperbola or a spline is taken by Schwarz's criterion.
    Auto,
    /// These, by their canonical names (`xp yp c k1 k2 k3 p1 p2 b1 b2 d0 d2..d7 e1 e2 h1 h2 h3`, and those of further
    /// terms that the range model has); all others are held. `splineN`, `polynomialN` and `surfaceN` stand for all terms
    /// of such a model, which the calibration then has: see [`calibrate`](crate::calibrate).
    List(Vec<String>),
}

/// What carries the datum.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NetworkDatum {
    /// Weighted control where there is any, inner constraints otherwise.
    #[default]
    Given,
    /// Inner constraints on the object points (Eq. 22); control is refused.
    Free,
    /// Weighted control: targets or stations with given standard deviations.
    Control,
}

/// Options of a network calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationOptions {
    /// Method. Default: [`Method::OneStep`].
    pub method: Method,
    /// Terms. Default: [`TermSelection::Auto`].
    pub terms: TermSelection,
    /// Datum. Default: [`NetworkDatum::Given`].
    pub datum: NetworkDatum,
    /// Stations whose ranges are left out, by name (convergent ones, whose ranges scattering would bias). Default:
    /// empty.
    pub without_ranges: Vec<String>,
    /// Significance level of the outlier test (data snooping, one at a time); `None`: nothing is rejected. Default 0.0001.
    pub rejection_level: Option<f64>,
    /// A combination of parameters that is known so many times worse than its parameters would be alone is refused as
    /// not determined. Default: 500.
    pub largest_inflation: f64,
}

impl Method {
    /// Name of the method in words.
    pub fn name(self) -> &'static str {
        match self {
            Self::OneStep => "one step",
            Self::TwoStepIndependent => "two steps, independent",
            Self::TwoStepDependent => "two steps, dependent",
            Self::JointTwoStep => "joint, two steps",
            Self::JointIntegrated => "joint, integrated",
            Self::Laboratory => "laboratory",
        }
    }
}

impl Default for CalibrationOptions {
    /// One step, automatic terms, free network, all ranges, rejection at 0.0001 (of three thousand sound values, one in three surveys loses one), inflation up to 500.
    fn default() -> Self {
        Self {
            method: Method::OneStep,
            terms: TermSelection::Auto,
            datum: NetworkDatum::Given,
            without_ranges: Vec::new(),
            rejection_level: Some(1e-4),
            // Networks of stations at many distances stay below 100, with the wave of length U below 250; twelve stations
            // at one distance have 4e5. Whatever is not in the model grows by the inflation as well: at 500 a hundredth of
            // a millimetre becomes half a centimetre.
            largest_inflation: 500.0,
        }
    }
}

impl CalibrationOptions {
    /// Checks numbers, and names of stations against the network; those of terms are checked where they are looked up.
    pub(crate) fn check(&self, network: &Network) -> Result<()> {
        if let Some(value) = self.rejection_level
            && !(value > 0.0 && value < 1.0)
        {
            let expected = "a level of significance is between 0 and 1";
            return Err(NetworkError::OutOfDomain { name: "rejection_level", value, expected }.into());
        }
        if self.largest_inflation.is_nan() || self.largest_inflation < 1.0 {
            let expected = "an inflation is at least 1";
            return Err(NetworkError::OutOfDomain {
                name: "largest_inflation",
                value: self.largest_inflation,
                expected,
            }
            .into());
        }
        for name in &self.without_ranges {
            if !network.stations.iter().any(|station| station.name == *name) {
                let known = network.stations.iter().map(|station| station.name.as_str()).collect::<Vec<_>>().join(", ");
                let what = "the list of stations without ranges".to_owned();
                return Err(NetworkError::UnknownName { what, kind: "station", name: name.clone(), known }.into());
            }
        }
        Ok(())
    }
}

/// Stations whose ranges take part.
pub(crate) fn ranged_stations(network: &Network, options: &CalibrationOptions) -> Vec<bool> {
    network.stations.iter().map(|station| !options.without_ranges.contains(&station.name)).collect()
}

/// Control that a message names.
const NAMED: usize = 4;

/// Known targets that carry a datum of six.
const LEAST_TARGETS: usize = 3;

/// The datum asked for, where the network agrees.
pub(crate) fn datum(network: &Network, options: &CalibrationOptions) -> Result<Datum> {
    let targets = network.targets.iter().filter(|target| target.covariance.is_some()).map(|target| &target.name);
    let stations = network.stations.iter().filter(|station| station.covariance.is_some()).map(|station| &station.name);
    let (targets, stations): (Vec<&String>, Vec<&String>) = (targets.collect(), stations.collect());
    let is_enough = targets.len() >= LEAST_TARGETS || !stations.is_empty();
    let control: Vec<&str> = targets.into_iter().chain(stations).map(String::as_str).collect();
    match options.datum {
        NetworkDatum::Free | NetworkDatum::Given if control.is_empty() => Ok(Datum::Inner),
        NetworkDatum::Free => Err(NetworkError::Datum {
            reason: format!(
                "a free network takes its datum from inner constraints, but {} {} standard deviations as control; \
                 ask for the datum `control`, or leave the standard deviations out",
                match control.as_slice() {
                    few if few.len() <= NAMED => few.join(", "),
                    many => format!("{} and {} others", many[..NAMED].join(", "), many.len() - NAMED),
                },
                if control.len() == 1 { "has" } else { "have" },
            ),
        }
        .into()),
        NetworkDatum::Control if control.is_empty() => Err(NetworkError::Datum {
            reason: "control was asked for, but no target and no station has standard deviations".to_owned(),
        }
        .into()),
        NetworkDatum::Given if !is_enough => Err(NetworkError::Datum {
            reason: format!(
                "of all targets only {} are known with standard deviations, too little control for a datum: give three \
                 targets or a station, or leave the standard deviations out",
                control.join(" and ")
            ),
        }
        .into()),
        NetworkDatum::Control | NetworkDatum::Given => Ok(Datum::Control),
    }
}

impl TermSelection {
    /// What cameras show of their terms, where these are chosen; those of a list are unknown.
    pub(crate) fn sigmas(&self, network: &Network) -> BTreeMap<&'static str, f64> {
        match self {
            Self::Auto => usual_sigmas(network),
            Self::List(_) => BTreeMap::new(),
        }
    }
}
