//! What a network lacks before any adjustment, named by the row that shows it.

use std::collections::BTreeSet;

use pipeline::{Error, Result};
use self_calibration::{DistanceEnd, Method, Network, NetworkDatum, NetworkError};

use crate::calibrate::network::network_files::NetworkFiles;

/// Refuses targets and stations that too few observations determine, and a control datum without control.
pub(crate) fn check(files: &NetworkFiles, method: Method, datum: NetworkDatum) -> Result<()> {
    let network = &files.network;
    if let Err(NetworkError::OutsideImage(found)) = network.validate() {
        let [low, high] = found.limits;
        let reason = format!("is {}, outside the image ({}), expected {low} to {high}", found.value, found.image);
        return Err(files.observations.error(found.sighting, found.component, reason).into());
    }
    let joint = matches!(method, Method::JointTwoStep | Method::JointIntegrated);
    if joint && network.passive.is_none() {
        let message = "is missing: a joint setup needs the survey of its passive camera there".to_owned();
        return Err(Error::Survey { path: files.folder.join("passive"), message });
    }
    if method == Method::Laboratory && network.distances.is_empty() && !has_control(network) {
        let message = "is missing or empty: the laboratory method needs known distances, or stations and targets \
                       with standard deviations"
            .to_owned();
        return Err(Error::Survey { path: files.folder.join("distances.csv"), message });
    }
    if datum == NetworkDatum::Control && !has_control(network) {
        let message = "has no standard deviations, and neither has stations.csv: \
                       the datum `control` needs targets or stations with some"
            .to_owned();
        return Err(Error::Survey { path: files.folder.join("targets.csv"), message });
    }
    if method == Method::Laboratory {
        return Ok(());
    }
    check_targets(files)?;
    check_stations(files, joint)
}

fn has_control(network: &Network) -> bool {
    network.targets.iter().any(|target| target.covariance.is_some())
        || network.stations.iter().any(|station| station.covariance.is_some())
}

/// A target seen from one station follows that station whatever it does, and checks nothing.
fn check_targets(files: &NetworkFiles) -> Result<()> {
    let network = &files.network;
    for (index, (target, own)) in network.targets.iter().zip(network.sightings_by_target()).enumerate() {
        let mut seen: BTreeSet<(bool, usize)> = BTreeSet::new();
        seen.extend(own.iter().map(|&row| (false, network.sightings[row].station)));
        let passive = network.passive.iter().flat_map(|passive| &passive.image_points);
        seen.extend(passive.filter(|point| point.target == index).map(|point| (true, point.station)));
        let measured = network.distances.iter().any(|d| [d.from, d.to].contains(&DistanceEnd::Target(index)));
        if seen.len() >= 2 || target.covariance.is_some() || measured {
            continue;
        }
        let name = &target.name;
        let Some(&row) = own.first() else {
            let message = format!("target `{name}` is seen once, and by the passive camera only");
            return Err(Error::Survey { path: files.folder.join("passive/observations.csv"), message });
        };
        let station = &network.stations[network.sightings[row].station].name;
        let reason = format!(
            "`{name}` is seen once, from station `{station}`: expected at least two stations, \
             or its standard deviations in targets.csv"
        );
        return Err(files.observations.error(row, "target", reason).into());
    }
    Ok(())
}

/// Three points orient a camera; with fewer its pose must come from elsewhere.
fn check_stations(files: &NetworkFiles, joint: bool) -> Result<()> {
    let network = &files.network;
    for (station, own) in network.stations.iter().zip(network.sightings_by_station()) {
        let points = own.len();
        if points >= 3 || station.covariance.is_some() || joint {
            continue;
        }
        let Some(&row) = own.first() else { continue };
        let name = |&row: &usize| network.targets[network.sightings[row].target].name.as_str();
        let targets: Vec<&str> = own.iter().map(name).collect();
        let reason = format!(
            "`{}` sees {points} target{} only ({}): expected at least three, or its pose with standard deviations \
             in stations.csv",
            station.name,
            if points == 1 { "" } else { "s" },
            targets.join(", ")
        );
        return Err(files.observations.error(row, "station", reason).into());
    }
    Ok(())
}
