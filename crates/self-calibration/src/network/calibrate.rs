//! The methods of Sect. 5.3.

use std::collections::BTreeSet;

use error_models::{AmplitudeHyperbola, RangeErrorModel};

use super::problem::{Calibration, Datum, Excluded, RangeSet, Setup};
use super::start::find_start;
use super::{CalibrationOptions, CalibrationOutcome, Method, Network, NetworkDatum, TermSelection};
use crate::{Error, Result};

/// Calibrates a range camera from a network of targets.
pub fn calibrate(network: &Network, options: &CalibrationOptions) -> Result<CalibrationOutcome> {
    network.validate()?;
    options.check(network)?;
    if options.method != Method::OneStep {
        let needs = "only the one-step method works on this network".to_owned();
        return Err(Error::MethodNeeds { method: format!("{:?}", options.method), needs });
    }
    let ranged = ranged_stations(network, options);
    network.check_coverage(&ranged, false)?;
    let calibration = start_calibration(network);
    let start = find_start(network, &calibration)?;
    let setup = Setup {
        network,
        start,
        calibration,
        estimated: selected(options),
        ranged,
        passive: false,
        datum: datum(network, options)?,
        geometry_held: false,
        camera_prior: None,
        excluded: Excluded::default(),
    };
    let solved = setup.solve()?;
    setup.outcome(&solved, options)
}

/// Stations whose ranges take part.
pub(crate) fn ranged_stations(network: &Network, options: &CalibrationOptions) -> Vec<bool> {
    network.stations.iter().map(|station| !options.without_ranges.contains(&station.name)).collect()
}

/// The calibration to start from: one set of range terms for each integration time, in the order in which the stations
/// name them.
pub(crate) fn start_calibration(network: &Network) -> Calibration {
    let mut sets: Vec<RangeSet> = Vec::new();
    for station in &network.stations {
        let time = station.integration_time_s;
        if !sets.iter().any(|set| set.time == time) {
            let suffix = match time {
                Some(time) if !sets.is_empty() => format!("@{time}"),
                None if !sets.is_empty() => "@unknown".to_owned(),
                _ => String::new(),
            };
            sets.push(RangeSet { time, suffix, model: open(&network.range_model) });
        }
    }
    Calibration { camera: network.camera, sets }
}

/// A model without spans: what is observed sets them.
fn open(model: &RangeErrorModel) -> RangeErrorModel {
    let hyperbola = model.hyperbola.map(|h| AmplitudeHyperbola { amplitude_span: [0.0, f64::MAX], ..h });
    RangeErrorModel { range_span_m: None, hyperbola, ..model.clone() }
}

fn selected(options: &CalibrationOptions) -> BTreeSet<String> {
    match &options.terms {
        TermSelection::List(names) => names.iter().cloned().collect(),
        TermSelection::Auto => ["xp", "yp", "c", "k1", "d0"].map(str::to_owned).into(),
    }
}

/// The datum asked for, where the network agrees.
pub(crate) fn datum(network: &Network, options: &CalibrationOptions) -> Result<Datum> {
    let targets = network.targets.iter().filter(|target| target.covariance.is_some()).map(|target| &target.name);
    let stations = network.stations.iter().filter(|station| station.covariance.is_some()).map(|station| &station.name);
    let control: Vec<&str> = targets.chain(stations).map(String::as_str).collect();
    match options.datum {
        NetworkDatum::Free if control.is_empty() => Ok(Datum::Inner),
        NetworkDatum::Free => Err(Error::Datum {
            reason: format!(
                "a free network takes its datum from inner constraints, but {} {} standard deviations as control; \
                 ask for the datum `control`, or leave the standard deviations out",
                control.join(", "),
                if control.len() == 1 { "has" } else { "have" },
            ),
        }),
        NetworkDatum::Control if control.is_empty() => Err(Error::Datum {
            reason: "control was asked for, but no target and no station has standard deviations".to_owned(),
        }),
        NetworkDatum::Control => Ok(Datum::Control),
    }
}

impl Default for CalibrationOptions {
    fn default() -> Self {
        Self {
            method: Method::OneStep,
            terms: TermSelection::Auto,
            datum: NetworkDatum::Free,
            without_ranges: Vec::new(),
            rejection_level: Some(0.001),
            largest_inflation: 500.0,
        }
    }
}
