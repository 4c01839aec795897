//! A network's scene as a survey folder with its truth.

use std::path::Path;

use atomic_output::{Destination, OutputFolder};
use commands::{Inputs, produce};
use pipeline::{Error, Result, Simulated};
use range_io::calibration::{Calibration, Provenance};
use range_io::survey::{Survey, TruthFiles};
use range_io::tables::{
    Station as StationRow, Target as TargetRow, TargetObservation, write_distances, write_observations, write_stations,
    write_targets,
};
use self_calibration::{Network, PassiveCamera, simulate_sightings};

use crate::scene::spec::{NetworkScene, distance_rows, survey_of_tables, true_calibration};

/// Start values that a run calibrates its network from.
pub(crate) const START: &str = "start.ron";

/// Simulates a network's scene into a survey folder `out`, which is complete or not there. A `seed` wins over the
/// scene's own.
///
/// The folder holds `observations.csv`, disturbed start values in `stations.csv` and `targets.csv`, known distances,
/// the passive camera's folder, and the truth below `truth`.
pub fn simulate_network(scene: &Path, seed: Option<u64>, out: &Path) -> Result<Simulated> {
    produce(out, &Inputs::default().path(scene), |destination| simulate_into(destination, scene, seed, None))
}

/// [`simulate_network`] with a calibration that is written as `start.ron` beside the tables.
pub(crate) fn simulate_into(
    destination: &Destination,
    scene: &Path,
    seed: Option<u64>,
    start: Option<&Calibration>,
) -> Result<Simulated> {
    let spec = NetworkScene::read(scene)?;
    let truth = spec.network(scene)?;
    let observed = simulate_sightings(&truth, &spec.sightings.options(seed.unwrap_or(spec.seed)))
        .map_err(|error| Error::Calibrate(error.into()))?;
    let folder = destination.open()?;
    write_observations(folder.file("observations.csv")?, &observations(&observed))?;
    write_stations(folder.file("stations.csv")?, &stations(&observed))?;
    write_targets(folder.file("targets.csv")?, &targets(&observed))?;
    if !observed.distances.is_empty() {
        write_distances(folder.file("distances.csv")?, &distance_rows(&observed))?;
    }
    write_stations(folder.file("truth/stations.csv")?, &stations(&truth))?;
    write_targets(folder.file("truth/targets.csv")?, &targets(&truth))?;
    let mut calibration = true_calibration(&spec.camera, &spec.truth, spec.amplitude_span, scene)?;
    calibration.provenance = provenance(scene);
    calibration.write(folder.file("truth/calibration.ron")?)?;
    let mut survey = survey_of_tables(&spec.camera);
    survey.truth = Some(TruthFiles {
        stations: Some("truth/stations.csv".into()),
        calibration: Some("truth/calibration.ron".into()),
        frames: Vec::new(),
    });
    survey.write(folder.file(Survey::FILE_NAME)?)?;
    write_passive(&spec, &observed, scene, &folder)?;
    if let Some(start) = start {
        start.write(folder.file(START)?)?;
    }
    folder.commit()?;
    Ok(Simulated { folder: destination.named().to_owned(), stations: observed.stations.len(), frames: 0 })
}

fn provenance(scene: &Path) -> Provenance {
    let survey = scene.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Provenance { survey, method: "truth of a simulation".to_owned(), ..Provenance::default() }
}

fn write_passive(spec: &NetworkScene, observed: &Network, scene: &Path, folder: &OutputFolder) -> Result<()> {
    let (Some(spec), Some(passive)) = (&spec.passive, &observed.passive) else { return Ok(()) };
    survey_of_tables(&spec.camera).write(folder.file(Path::new("passive").join(Survey::FILE_NAME))?)?;
    let mut calibration = spec.calibration(scene)?;
    calibration.provenance = provenance(scene);
    calibration.write(folder.file(Path::new("passive").join(Calibration::FILE_NAME))?)?;
    write_observations(folder.file("passive/observations.csv")?, &passive_observations(observed, passive))?;
    Ok(())
}

/// Ten significant digits of an observed value: far below any noise, and tables that people can read.
fn rounded(value: f64) -> f64 {
    let magnitude = value.abs().log10().floor();
    if !magnitude.is_finite() {
        return value;
    }
    let scale = 10.0_f64.powf(9.0 - magnitude);
    (value * scale).round() / scale
}

fn observations(network: &Network) -> Vec<TargetObservation> {
    let row = |sighting: &self_calibration::Sighting| TargetObservation {
        station: network.stations[sighting.station].name.clone(),
        target: network.targets[sighting.target].name.clone(),
        pixel: sighting.pixel.map(|pixel| pixel.map(rounded)),
        range_m: sighting.range_m.map(rounded),
        sigma_pixel: Some(sighting.sigma_pixel),
        sigma_range_m: Some(sighting.sigma_range_m),
        amplitude: sighting.amplitude.map(rounded),
        integration_time_s: network.stations[sighting.station].integration_time_s,
    };
    network.sightings.iter().map(row).collect()
}

fn passive_observations(network: &Network, passive: &PassiveCamera) -> Vec<TargetObservation> {
    let row = |point: &self_calibration::PassiveImagePoint| TargetObservation {
        station: network.stations[point.station].name.clone(),
        target: network.targets[point.target].name.clone(),
        pixel: Some(point.pixel.map(rounded)),
        sigma_pixel: Some(point.sigma_pixel),
        ..TargetObservation::default()
    };
    passive.image_points.iter().map(row).collect()
}

fn stations(network: &Network) -> Vec<StationRow> {
    let row = |station: &self_calibration::Station| {
        Some(StationRow {
            station: station.name.clone(),
            world_from_camera: station.world_from_camera?,
            sigma_position_m: None,
            sigma_attitude_rad: None,
            doubt: None,
        })
    };
    network.stations.iter().filter_map(row).collect()
}

fn targets(network: &Network) -> Vec<TargetRow> {
    let row = |target: &self_calibration::NetworkTarget| {
        Some(TargetRow {
            target: target.name.clone(),
            position_m: target.point?.coords.map(rounded).into(),
            sigma_m: target.covariance.map(|covariance| [0, 1, 2].map(|axis| covariance[(axis, axis)].sqrt())),
        })
    };
    network.targets.iter().filter_map(row).collect()
}
