//! A survey's tables to a network, with every fault named by its place.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use commands::plan::DriftTreatment;
use commands::root_of;
use nalgebra::{Matrix3, Point3, Vector3};
use pipeline::survey::ViewDrift;
use pipeline::{Error, Result};
use range_io::survey::Survey;
use range_io::tables::{
    PlacedRows, Station as StationRow, Target as TargetRow, TargetObservation, read_placed_observations,
    read_placed_stations, read_placed_targets,
};
use self_calibration::{Network, NetworkTarget, Sighting, Station};

use crate::calibrate::network::distances::named_distances;
use crate::calibrate::network::passive::read_passive;
use crate::calibrate::request::TableDefaults;
use crate::calibrate::start::Start;
use crate::calibrate::start::drift::KnownDrift;

/// A network with what it was read from.
#[derive(Debug, Clone)]
pub(crate) struct NetworkFiles {
    pub(crate) network: Network,
    pub(crate) start: Start,
    pub(crate) folder: PathBuf,
    /// The rows behind the sightings, in their order.
    pub(crate) observations: PlacedRows<TargetObservation>,
}

/// Reads `survey.ron` and the tables beside it; `shared_targets` takes the place of the `targets.csv` there.
pub(crate) fn read_network(
    survey_path: &Path,
    calibration: Option<&Path>,
    shared_targets: Option<&Path>,
    defaults: &TableDefaults,
    warm_up: DriftTreatment,
) -> Result<NetworkFiles> {
    let survey = Survey::read(survey_path)?;
    let root = root_of(survey_path);
    let mut start = Start::read(&survey, &root, calibration)?;
    let observations = read_placed_observations(root.join("observations.csv"))?;
    if observations.rows.is_empty() {
        let message = "has no rows, expected target observations".to_owned();
        return Err(Error::Survey { path: observations.file().to_owned(), message });
    }
    let stations = optional(&root.join("stations.csv"), read_placed_stations)?;
    let targets = root.join("targets.csv");
    let targets = optional(shared_targets.unwrap_or(&targets), read_placed_targets)?;
    let mut tables = Tables::new(&survey, stations, targets);
    let sightings = tables.sightings(&observations, defaults)?;
    let passive = read_passive(&root.join("passive"), &mut tables, defaults)?;
    for station in &mut tables.stations {
        station.integration_time_s = station.integration_time_s.or(defaults.integration_time_s);
    }
    let distances = named_distances(&root.join("distances.csv"), &tables.stations, &tables.targets)?;
    let drifts = take_drifts(&survey, &root, &start, warm_up, &sightings, &mut tables.stations)?;
    start.set_drifts(drifts);
    let rows = observations.rows.iter().enumerate();
    start.lines = rows.map(|(i, row)| ((row.station.clone(), row.target.clone()), observations.line(i))).collect();
    let network = Network {
        camera: start.camera,
        range_model: start.range_model.clone(),
        stations: tables.stations,
        targets: tables.targets,
        sightings,
        distances,
        passive,
    };
    Ok(NetworkFiles { network, start, folder: root, observations })
}

/// Gives each station with ranges its known drift.
fn take_drifts(
    survey: &Survey,
    root: &Path,
    start: &Start,
    warm_up: DriftTreatment,
    sightings: &[Sighting],
    stations: &mut [Station],
) -> Result<Vec<ViewDrift>> {
    let known = KnownDrift::new(start.calibration.as_ref(), survey, root, warm_up)?;
    let mut drifts = Vec::new();
    let ranged: BTreeSet<usize> = sightings.iter().filter(|s| s.range_m.is_some()).map(|s| s.station).collect();
    for (index, station) in stations.iter_mut().enumerate() {
        if ranged.contains(&index)
            && let Some(drift) = known.of_station(&station.name)?
        {
            station.drift_m = drift.drift_m;
            drifts.push(drift);
        }
    }
    Ok(drifts)
}

pub(crate) fn optional<T>(
    path: &Path,
    read: fn(PathBuf) -> std::result::Result<PlacedRows<T>, range_io::Error>,
) -> Result<PlacedRows<T>> {
    if path.is_file() { Ok(read(path.to_owned())?) } else { Ok(PlacedRows::none(path)) }
}

/// Stations and targets as they appear, with what their tables know of them.
pub(crate) struct Tables {
    pub(crate) stations: Vec<Station>,
    pub(crate) targets: Vec<NetworkTarget>,
    station_rows: PlacedRows<StationRow>,
    target_rows: PlacedRows<TargetRow>,
    frame_times: BTreeMap<String, f64>,
}

impl Tables {
    fn new(survey: &Survey, station_rows: PlacedRows<StationRow>, target_rows: PlacedRows<TargetRow>) -> Self {
        let times = survey.frames.iter().filter_map(|frame| Some((frame.station.clone(), frame.integration_time_s?)));
        let frame_times = times.collect();
        Self { stations: Vec::new(), targets: Vec::new(), station_rows, target_rows, frame_times }
    }

    /// Position of a station, which is added where it is new.
    fn station(&mut self, name: &str) -> usize {
        if let Some(index) = self.stations.iter().position(|station| station.name == name) {
            return index;
        }
        let row = self.station_rows.rows.iter().find(|row| row.station == name);
        self.stations.push(Station {
            name: name.to_owned(),
            world_from_camera: row.map(|row| row.world_from_camera),
            covariance: row.and_then(StationRow::covariance),
            integration_time_s: self.frame_times.get(name).copied(),
            drift_m: 0.0,
        });
        self.stations.len() - 1
    }

    /// Position of a target, which is added where it is new.
    pub(crate) fn target(&mut self, name: &str) -> usize {
        if let Some(index) = self.targets.iter().position(|target| target.name == name) {
            return index;
        }
        let row = self.target_rows.rows.iter().find(|row| row.target == name);
        let variances = |sigma: [f64; 3]| Matrix3::from_diagonal(&Vector3::from(sigma.map(|s| s * s)));
        self.targets.push(NetworkTarget {
            name: name.to_owned(),
            point: row.map(|row| Point3::from(row.position_m)),
            covariance: row.and_then(|row| row.sigma_m).map(variances),
        });
        self.targets.len() - 1
    }

    fn sightings(&mut self, rows: &PlacedRows<TargetObservation>, defaults: &TableDefaults) -> Result<Vec<Sighting>> {
        refuse_repeats(rows)?;
        let mut sightings = Vec::with_capacity(rows.rows.len());
        for (index, row) in rows.rows.iter().enumerate() {
            let station = self.station(&row.station);
            self.set_time(station, rows, index)?;
            sightings.push(Sighting {
                station,
                target: self.target(&row.target),
                pixel: row.pixel,
                sigma_pixel: sigma_pixel(rows, index, defaults)?,
                range_m: row.range_m,
                sigma_range_m: sigma_range(rows, index, defaults)?,
                amplitude: row.amplitude,
            });
        }
        Ok(sightings)
    }

    /// A station has one integration time: that of its rows, or of its frames.
    fn set_time(&mut self, station: usize, rows: &PlacedRows<TargetObservation>, index: usize) -> Result<()> {
        let Some(time) = rows.rows[index].integration_time_s else { return Ok(()) };
        let station = &mut self.stations[station];
        match station.integration_time_s {
            Some(known) if (known / time - 1.0).abs() > 1e-9 => {
                let reason = format!("is {time} s, but station `{}` has {known} s elsewhere", station.name);
                Err(rows.error(index, "integration_time_s", reason).into())
            }
            _ => {
                station.integration_time_s = Some(time);
                Ok(())
            }
        }
    }
}

/// A target is observed once from a station.
pub(crate) fn refuse_repeats(rows: &PlacedRows<TargetObservation>) -> Result<()> {
    let mut seen = BTreeMap::new();
    for (index, row) in rows.rows.iter().enumerate() {
        if let Some(first) = seen.insert((&row.station, &row.target), index) {
            let (target, station, line) = (&row.target, &row.station, rows.line(first));
            let reason = format!("`{target}` is observed from `{station}` twice, first in line {line}");
            return Err(rows.error(index, "target", reason).into());
        }
    }
    Ok(())
}

/// Standard deviations of an image point; those of an unobserved one carry no weight.
pub(crate) fn sigma_pixel(
    rows: &PlacedRows<TargetObservation>,
    index: usize,
    defaults: &TableDefaults,
) -> Result<[f64; 2]> {
    let row = &rows.rows[index];
    let sigma = row.sigma_pixel.or(defaults.sigma_pixel.map(|sigma| [sigma; 2]));
    match sigma {
        Some(sigma) => Ok(sigma),
        None if row.pixel.is_none() => Ok([1.0; 2]),
        None => Err(rows.error(index, "sigma_col", missing("--sigma-pixel")).into()),
    }
}

fn sigma_range(rows: &PlacedRows<TargetObservation>, index: usize, defaults: &TableDefaults) -> Result<f64> {
    let row = &rows.rows[index];
    match row.sigma_range_m.or(defaults.sigma_range_m) {
        Some(sigma) => Ok(sigma),
        None if row.range_m.is_none() => Ok(1.0),
        None => Err(rows.error(index, "sigma_range", missing("--sigma-range")).into()),
    }
}

fn missing(option: &str) -> String {
    format!("is empty, expected a standard deviation: give it here, or one for all such rows with {option}")
}
