//! The calibration that a network is adjusted from.

use camera_model::Camera;
use error_models::{AmplitudeHyperbola, RangeErrorModel};

use crate::Network;
use crate::functional_model::setup::{Calibration, RangeSet};

/// The calibration to start from: one set of range terms for each integration time, in the order in which the stations
/// name them.
pub fn start_calibration(network: &Network) -> Calibration {
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

/// A calibration known from elsewhere as the start of a network: the camera, and the range terms of each integration time
/// that are given, without their spans; those of the network for other times.
pub fn calibration_from(network: &Network, camera: Camera, models: &[(Option<f64>, RangeErrorModel)]) -> Calibration {
    let mut calibration = start_calibration(network);
    calibration.camera = camera;
    for set in &mut calibration.sets {
        if let Some((_, model)) = models.iter().find(|(time, _)| *time == set.time) {
            set.model = open(model);
        }
    }
    calibration
}

/// A model without spans: what is observed sets them.
fn open(model: &RangeErrorModel) -> RangeErrorModel {
    let hyperbola = model.hyperbola.map(|h| AmplitudeHyperbola { amplitude_span: [0.0, f64::MAX], ..h });
    RangeErrorModel { range_span_m: None, hyperbola, ..model.clone() }
}
