//! Registration of all stations: from clouds to one coordinate system.

use std::sync::Arc;

use nalgebra::{DMatrix, Isometry3, Matrix6};
use rayon::prelude::*;

use super::grouping::patch_size;
use super::network::{Network, State};
use super::patches::Surface;
use super::point_model::{SharedParameters, checked_prior};
use super::pose_graph::Datum;
use super::precision;
use super::reduction::{Meeting, Scene, Weighting};
use super::registration::{Start, StationRegistration, StationRegistrationOptions, SurfacePair, UndeterminedStation};
use super::rounds::{Adjusted, Course, Surfaces};
use super::start::{Started, Starter};
use crate::cloud::Cloud;
use crate::error::{Error, Result};
use crate::kernel::quantile;
use crate::normals::{UnorganisedNormalOptions, unorganised_normals};
use crate::pose::is_finite;

/// Brings the clouds of many stations into one coordinate system.
///
/// Pairs that overlap are aligned, pairs that contradict the loops of the others are left out, and then all stations are
/// adjusted at once: wherever patches of two stations meet, their distance along the common normal is one observation,
/// over all overlaps and in one system, with contacts found anew in each round (`[ChenMedioni1992]`, `[Pulli1999]`).
/// `progress(done, total)` is told the pairs aligned and the rounds of the adjustment.
///
/// Clouds without normals get them from their nearest neighbours.
///
/// # Errors
/// [`Error::UnconnectedStations`] names stations that no pair leads to; [`Error::Empty`], [`Error::LengthMismatch`],
/// [`Error::NonFinite`], [`Error::NotPositive`], [`Error::NoSuchStation`], [`Error::InvalidOption`] for the input;
/// [`Error::Adjustment`] where shared parameters are not determined.
pub fn register_stations(
    stations: &[Cloud],
    start: Start<'_>,
    datum: Datum,
    options: &StationRegistrationOptions<'_>,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<StationRegistration> {
    validate(stations, start, datum, options)?;
    let surfaces = prepare(stations, options)?;
    let patch_m = surfaces[0].size_m;
    let radius_m = surfaces.iter().map(|surface| surface.radius_m).fold(0.0, f64::max);
    let starter = Starter { surfaces: &surfaces, options, patch_m, radius_m, datum, progress };
    let blind = match start {
        Start::Poses(_) => None,
        _ => Some(starter.without_poses(start, &|pairs| super::blind::poses(stations, pairs))?),
    };
    let poses = match (start, &blind) {
        (Start::Poses(poses), _) => poses.to_vec(),
        (_, Some(started)) => started.poses.clone(),
        _ => Vec::new(),
    };
    let (prior, names) = match options.model {
        Some(model) => (checked_prior(model)?, model.names()),
        None => Default::default(),
    };
    let course = Course {
        network: Network { fixed: datum.held_station(), hold_m: radius_m, names: &names, prior: &prior },
        reach_m: starter.reach_m(start),
        minimum_contacts: options.minimum_contacts,
        kernel: options.kernel,
        max_rounds: options.max_rounds,
        tolerance_m: options.tolerance_m.unwrap_or(patch_m / 2000.0),
        progress: &|done| progress(done, options.max_rounds),
    };
    let mut modelled = Surfaces::fixed(surfaces.iter().collect());
    modelled.model = options.model.map(|model| (model, stations.iter().map(Cloud::len).collect()));
    let adjusted = course.run(&mut modelled, State { poses: poses.clone(), parameters: prior.0.clone() })?;
    require_connected(&adjusted, datum)?;
    let started = match blind {
        Some(started) => started,
        None => Started { poses, ..starter.check(&adjusted.state.poses)? },
    };
    let result = finish(&modelled, started, adjusted, &course.network, datum);
    let prepared = match modelled.modelled {
        Some((modelled, _)) => modelled,
        None => surfaces,
    };
    Ok(StationRegistration { prepared: Arc::new(prepared), ..result })
}

/// Every station meets, through others, the one that is held.
fn require_connected(adjusted: &Adjusted, datum: Datum) -> Result<()> {
    let mut reached = vec![false; adjusted.state.poses.len()];
    reached[datum.held_station()] = true;
    let mut grown = true;
    while grown {
        grown = false;
        for meeting in &adjusted.meetings {
            if reached[meeting.target] != reached[meeting.source] {
                (reached[meeting.target], reached[meeting.source]) = (true, true);
                grown = true;
            }
        }
    }
    let stations: Vec<usize> = (0..reached.len()).filter(|&station| !reached[station]).collect();
    if stations.is_empty() {
        return Ok(());
    }
    let reasons = vec!["no surfaces of theirs meet those of the others".to_owned()];
    Err(Error::UnconnectedStations { stations, to: datum.held_station(), reasons })
}

fn validate(
    stations: &[Cloud],
    start: Start<'_>,
    datum: Datum,
    options: &StationRegistrationOptions<'_>,
) -> Result<()> {
    if stations.is_empty() {
        return Err(Error::Empty { what: "the list of stations" });
    }
    stations.iter().try_for_each(|cloud| cloud.validate("the cloud of a station"))?;
    if let Start::Poses(poses) = start {
        super::pose_graph::require_poses(stations.len(), poses)?;
        if let Some(index) = poses.iter().position(|pose| !is_finite(pose)) {
            return Err(Error::NonFinite { what: "poses of the stations", index });
        }
    }
    let (station, count) = (datum.held_station(), stations.len());
    if station >= count {
        return Err(Error::NoSuchStation { station, count });
    }
    let lengths = [
        ("start_error_m", options.start_error_m),
        ("patch_m", options.patch_m),
        ("loop_tolerance_m", options.loop_tolerance_m),
        ("tolerance_m", options.tolerance_m),
    ];
    for (name, value) in lengths {
        if let Some(value) = value
            && !(value > 0.0 && value < 1e100)
        {
            return Err(Error::InvalidOption { name, value, domain: "positive and finite" });
        }
    }
    if !(options.minimum_overlap >= 0.0 && options.minimum_overlap <= 1.0) {
        return Err(Error::InvalidOption { name: "minimum_overlap", value: options.minimum_overlap, domain: "0 to 1" });
    }
    match (options.partners_per_station, options.max_rounds) {
        (0, _) => Err(Error::InvalidOption { name: "partners_per_station", value: 0.0, domain: "1 or more" }),
        (_, 0) => Err(Error::InvalidOption { name: "max_rounds", value: 0.0, domain: "1 or more" }),
        _ => Ok(()),
    }
}

/// The stations as patches, all of one size.
fn prepare(stations: &[Cloud], options: &StationRegistrationOptions<'_>) -> Result<Vec<Surface>> {
    let size_m = options.patch_m.unwrap_or_else(|| {
        let mut sizes: Vec<f64> = stations.par_iter().map(patch_size).collect();
        quantile(&mut sizes, 0.5)
    });
    let prepare = |cloud: &Cloud| match &cloud.normals {
        Some(normals) => Surface::new(cloud, normals, size_m),
        None => {
            let normals = unorganised_normals(&cloud.points, &UnorganisedNormalOptions::default())?;
            Surface::new(cloud, &normals, size_m)
        }
    };
    stations.par_iter().map(prepare).collect()
}

fn finish(
    surfaces: &Surfaces<'_>,
    started: Started,
    adjusted: Adjusted,
    network: &Network<'_>,
    datum: Datum,
) -> StationRegistration {
    let count = adjusted.state.poses.len();
    let parameters = adjusted.state.parameters.len();
    let scene = surfaces.scene(parameters);
    let redundancy = adjusted.observations.round() as i64 - 6 * (count as i64 - 1) - parameters as i64;
    let sigma0 = (redundancy > 0).then(|| (adjusted.squares / redundancy as f64).sqrt());
    let covariance = precision::covariance(&scene, &adjusted, network.hold_m, sigma0.unwrap_or(1.0).powi(2));
    let undetermined = undetermined(&adjusted.state.poses, &covariance, network.hold_m);
    let pairs = adjusted.meetings.iter().map(|m| surface_pair(&scene, m, &adjusted.state.poses, &adjusted.weighting));
    let pairs = pairs.collect();
    let poses = adjusted.state.poses;
    let (poses, joint) = datum.apply(&started.poses, poses, covariance, network.hold_m);
    StationRegistration {
        covariance: (0..count).map(|k| joint.fixed_view::<6, 6>(6 * k, 6 * k).into_owned()).collect(),
        world_from_station: poses,
        pairs: started.pairs,
        refused: started.refused,
        loops: started.loops,
        surfaces: pairs,
        undetermined,
        sigma0,
        redundancy,
        rounds: adjusted.rounds,
        settled: adjusted.settled,
        parameters: (parameters > 0).then(|| shared(network, &adjusted.state.parameters, &joint)),
        joint_covariance: joint,
        prepared: Arc::default(),
    }
}

fn undetermined(poses: &[Isometry3<f64>], covariance: &DMatrix<f64>, hold_m: f64) -> Vec<UndeterminedStation> {
    let motions = poses.iter().enumerate().map(|(station, pose)| {
        let own: Matrix6<f64> = covariance.fixed_view::<6, 6>(6 * station, 6 * station).into_owned();
        UndeterminedStation { station, motions: precision::undetermined(pose, &own, hold_m) }
    });
    motions.filter(|station| !station.motions.is_empty()).collect()
}

fn surface_pair(scene: &Scene<'_>, meeting: &Meeting, poses: &[Isometry3<f64>], weighting: &Weighting) -> SurfacePair {
    let pose = poses[meeting.target].inverse() * poses[meeting.source];
    let (mut weight, mut mean, mut square, mut whitened, mut outliers) = (0.0, 0.0, 0.0, 0.0, 0_usize);
    for contact in &meeting.contacts {
        let (row, observed) = scene.row(meeting, contact, &pose, weighting);
        // Along the normal that points to the target station, so that the sign means nearer or farther.
        let towards = if observed.normal.dot(&observed.place) > 0.0 { -observed.residual } else { observed.residual };
        weight += row.weight;
        mean += row.weight * towards;
        square += row.weight * observed.residual.powi(2);
        whitened += row.weight * row.residual.powi(2);
        outliers += usize::from(row.weight < 0.1 * contact.share);
    }
    let asked = meeting.contacts.iter().filter(|contact| contact.asked_by_source).count();
    let of = |sum: f64| if weight > 0.0 { sum / weight } else { 0.0 };
    SurfacePair {
        target: meeting.target,
        source: meeting.source,
        overlap: asked as f64 / scene.surfaces[meeting.source].patches.len() as f64,
        contacts: meeting.contacts.len(),
        mean_m: of(mean),
        rms_m: of(square).sqrt(),
        rms_sigma: of(whitened).sqrt(),
        outliers: outliers as f64 / meeting.contacts.len().max(1) as f64,
    }
}

fn shared(network: &Network<'_>, values: &[f64], joint: &DMatrix<f64>) -> SharedParameters {
    let m = values.len();
    let first = joint.nrows() - m;
    let sigma = |k: usize| joint[(k, k)].max(0.0).sqrt();
    let correlation = |k: usize, row: usize| {
        let product = sigma(first + k) * sigma(row);
        if product > 0.0 { joint[(row, first + k)] / product } else { 0.0 }
    };
    let largest = |k: usize| {
        let row = (0..first).max_by(|&a, &b| correlation(k, a).abs().total_cmp(&correlation(k, b).abs()));
        row.map_or((0, 0, 0.0), |row| (row / 6, row % 6, correlation(k, row)))
    };
    let significance = |k: usize| {
        let sigma = sigma(first + k);
        if sigma > 0.0 { (values[k] - network.prior.0[k]) / sigma } else { 0.0 }
    };
    SharedParameters {
        names: network.names.to_vec(),
        values: values.to_vec(),
        covariance: (0..m).map(|r| (0..m).map(|c| joint[(first + r, first + c)]).collect()).collect(),
        prior: network.prior.0.clone(),
        prior_sigma: network.prior.1.clone(),
        significance: (0..m).map(significance).collect(),
        largest_pose_correlation: (0..m).map(largest).collect(),
    }
}
