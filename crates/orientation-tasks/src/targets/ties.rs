//! All stations at once, from targets of which nothing is known.

use std::collections::BTreeMap;

use commands::{Doubt, DoubtKind};
use orientation::{
    Error as Cause, ImagePoint, NetworkOptions, NetworkScale, ObservedPart, TieObservation, orient_network,
};
use pipeline::survey::StationPose;
use pipeline::{Error, Result};
use statistics::chi_squared_limit;

use crate::camera::SurveyCamera;
use crate::outcome::{Outcome, Placed};
use crate::summary::{OrientSummary, RejectedValue};
use crate::targets::sightings::Sightings;

/// Level of the test of all observations.
const LEVEL: f64 = 0.001;

pub(crate) fn orient(camera: &SurveyCamera, sightings: &Sightings) -> Result<Outcome> {
    let mut numbers: BTreeMap<&str, usize> = BTreeMap::new();
    let (mut ties, mut places) = (Vec::new(), Vec::new());
    for (station, (_, own)) in sightings.stations.iter().enumerate() {
        for seen in own {
            let next = numbers.len();
            let target = *numbers.entry(&seen.target).or_insert(next);
            let image = ImagePoint { pixel: seen.pixel, sigma_pixel: seen.sigma_pixel };
            ties.push(TieObservation { station, target, image, range: seen.range });
            places.push((station, seen));
        }
    }
    let names: Vec<&str> = sightings.stations.iter().map(|(name, _)| name.as_str()).collect();
    let found = orient_network(&camera.camera, &ties, &NetworkOptions::default())
        .map_err(|error| refused(camera, &error, &names))?;
    let first = names.first().copied().unwrap_or_default();
    let mut summary =
        OrientSummary { datum: format!("the camera's frame at station {first}"), ..OrientSummary::default() };
    summary.findings.push(format!("{} targets tie {} stations together", numbers.len(), names.len()));
    match found.scale {
        NetworkScale::Ranges => summary.findings.push("ranges give the scale".to_owned()),
        NetworkScale::BaseTo(station) => {
            let words = format!(
                "without ranges or coordinates the scale is not known: positions are in units of the distance of {} from {first}",
                names.get(station).copied().unwrap_or_default()
            );
            summary.doubts.push(Doubt::new(DoubtKind::Units, words));
        }
    }
    summary.rejected = found
        .gross_errors
        .iter()
        .filter_map(|(index, part)| {
            let (station, seen) = places.get(*index)?;
            let part = match part {
                ObservedPart::Column => "column",
                ObservedPart::Row => "row",
                ObservedPart::Range => "range",
            };
            let station = (*names.get(*station)?).to_owned();
            Some(RejectedValue { station, target: seen.target.clone(), part, line: seen.line })
        })
        .collect();
    if let Some(sigma0) = found.sigma0 {
        let redundancy = found.redundancy as f64;
        let limit = (chi_squared_limit(redundancy, LEVEL) / redundancy).sqrt();
        summary.findings.push(format!("sigma0 {sigma0:.2}, redundancy {redundancy}"));
        if sigma0 > limit {
            let words =
                format!("observations scatter {sigma0:.1} times as much as stated (by chance up to {limit:.2})");
            summary.doubts.push(Doubt::new(DoubtKind::Contradiction, words));
        }
    }
    let placed = |(name, station): (&&str, &orientation::OrientedStation)| {
        let pose = StationPose { world_from_camera: station.first_from_station, covariance: Some(station.covariance) };
        Placed::new(name, camera.times(name)[0], pose)
    };
    let stations = names.iter().zip(&found.stations).map(placed).collect();
    Ok(Outcome { summary, stations })
}

/// What the data do not settle, with the names of stations for their numbers.
fn refused(camera: &SurveyCamera, error: &Cause, names: &[&str]) -> Error {
    let words = match error {
        Cause::NotConnected { station, shared } => format!(
            "station {} shares {shared} targets with what can be oriented; three with ranges are needed, or four image points",
            names.get(*station).copied().unwrap_or_default()
        ),
        other => other.to_string(),
    };
    Error::estimation("orientation by tie points", &camera.root)(Words(words))
}

/// A cause in words.
#[derive(Debug)]
struct Words(String);

impl std::fmt::Display for Words {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Words {}
