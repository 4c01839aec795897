//! Registration of all stations: from clouds to one coordinate system.

use std::borrow::Cow;
use std::sync::Arc;

use nalgebra::{DMatrix, Isometry3, Matrix6, Vector3};
use rayon::prelude::*;
use statistics::upper_median;

use crate::adjustment::network::{Network, State};
use crate::adjustment::precision;
use crate::adjustment::rounds::{FEWEST_CONTACTS, Surfaces, WideRounds};
use crate::adjustment::simultaneous::{Adjusted, Finish, MOST_ROUNDS};
use crate::agreement::alignments::Overlap;
use crate::agreement::loops::reached;
use crate::agreement::placement::{Placements, judge_placements};
use crate::error::{Error, Result};
use crate::surfaces::patch_size;
use crate::surfaces::patches::Surface;
use crate::surfaces::point_model::{SharedParameters, checked_prior};
use crate::surfaces::points::StationPoints;
use crate::survey::check::{Checked, checked};
use crate::survey::datum::Datum;
use crate::survey::registration::{
    Start, StationRegistration, StationRegistrationOptions, SurfacePair, UndeterminedStation,
};
use point_cloud::Cloud;
use point_cloud::{UnorganisedNormalOptions, unorganised_normals};
use rigid_pose::is_finite;

/// Default of the error of approximate poses, in radii of the clouds.
const START_ERROR: f64 = 0.2;
/// The rounds end when no station moves by more than a patch over this: some hundredths of a millimetre.
const TOLERANCE: f64 = 2000.0;

/// Brings the clouds of many stations into one coordinate system.
///
/// Wide rounds bring the stations together where patches of their surfaces meet, all overlaps in one system with contacts
/// found anew in each round (`[ChenMedioni1992]`, `[Pulli1999]`). The last rounds take all points: each station's pieces of
/// a surface are joined to shared planes, whose planes are unknown too and eliminated exactly. Then pairs are held against their
/// loops. `progress(done, total)` is told the rounds of each part.
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
    let poses = match start {
        Start::Poses(poses) => poses.to_vec(),
        _ => crate::survey::blind::arranged(stations, start, datum.held_station(), options.turns)?,
    };
    // Stations that were arranged by what they saw may have slid along walls together: they are not known better.
    let reach_m = options.start_error_m.unwrap_or(START_ERROR * radius_m);
    let (prior, names) = match options.model {
        Some(model) => (checked_prior(model)?, model.names()),
        None => Default::default(),
    };
    let network = Network {
        fixed: datum.held_station(),
        hold_m: radius_m,
        turn_rad: 1.0,
        names: &names,
        prior: &prior,
        turns: options.turns,
    };
    let total = |done| progress(done, MOST_ROUNDS);
    let wide_rounds = WideRounds { network: &network, reach_m, progress: &total };
    let mut modelled = Surfaces::fixed(surfaces.iter().collect());
    modelled.model = options.model.map(|model| (model, stations.iter().map(Cloud::len).collect()));
    let near = wide_rounds.run(&mut modelled, State { poses: poses.clone(), parameters: prior.0.clone() })?;
    let finish = Finish {
        network: &network,
        near: network.near(patch_m / 2.0),
        tolerance_m: patch_m / TOLERANCE,
        progress: &total,
    };
    let mut points: Vec<StationPoints> =
        stations.par_iter().zip(&surfaces).map(|(cloud, surface)| StationPoints::new(cloud, surface)).collect();
    let mut adjusted = finish.run(&mut modelled, &mut points, near)?;
    if let Some(state) = returned(&adjusted, &poses, &network, patch_m) {
        // Wide rounds may have moved stations where noise alone told them to.
        adjusted = finish.run(&mut modelled, &mut points, state)?;
    }
    require_connected(&adjusted, datum)?;
    let placements = placements(stations, &points, &adjusted.state)?;
    let checked = checked(&adjusted, options.minimum_overlap, datum, (radius_m, patch_m))?;
    let result = result(checked, adjusted, &poses, &network, datum, patch_m);
    let prepared = match modelled.modelled {
        Some((modelled, _)) => modelled,
        None => surfaces,
    };
    Ok(StationRegistration { placements, prepared: Arc::new(prepared), ..result })
}

/// Every station shares surfaces, through others, with the one that is held.
fn require_connected(adjusted: &Adjusted, datum: Datum) -> Result<()> {
    let ends: Vec<(usize, usize)> =
        adjusted.overlaps(FEWEST_CONTACTS).iter().map(|pair| (pair.target, pair.source)).collect();
    let reached = reached(&ends, datum.held_station());
    let stations: Vec<usize> = (0..adjusted.state.poses.len()).filter(|station| !reached.contains(station)).collect();
    if stations.is_empty() {
        return Ok(());
    }
    let all = adjusted.overlaps(1);
    let reason = |&station: &usize| {
        let with = all.iter().filter(|pair| {
            let other = if pair.target == station { pair.source } else { pair.target };
            (pair.target == station || pair.source == station) && reached.contains(&other)
        });
        let tiles = with.map(|pair| adjusted.shared(pair.target, pair.source).len()).max().unwrap_or(0);
        format!("shares {tiles} tiles of common surfaces with any of the others, at least {FEWEST_CONTACTS} are needed")
    };
    let reasons = stations.iter().map(reason).collect();
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
        crate::relative_pose::require_poses(stations.len(), poses)?;
        if let Some(index) = poses.iter().position(|pose| !is_finite(pose)) {
            return Err(Error::NonFinite { what: "poses of the stations", index });
        }
    }
    let (station, count) = (datum.held_station(), stations.len());
    if station >= count {
        return Err(Error::NoSuchStation { station, count });
    }
    options.turns.iter().try_for_each(|turn| turn.check(count))?;
    let lengths = [("start_error_m", options.start_error_m), ("patch_m", options.patch_m)];
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
    Ok(())
}

/// The stations as patches, all of one size.
fn prepare(stations: &[Cloud], options: &StationRegistrationOptions<'_>) -> Result<Vec<Surface>> {
    let normals: Vec<Cow<'_, [Vector3<f64>]>> = stations.par_iter().map(normals_of).collect::<Result<_>>()?;
    let size_m = options.patch_m.unwrap_or_else(|| {
        let mut sizes: Vec<f64> =
            stations.par_iter().zip(&normals).map(|(cloud, normals)| patch_size::size(cloud, normals)).collect();
        upper_median(&mut sizes)
    });
    stations.par_iter().zip(&normals).map(|(cloud, normals)| Surface::new(cloud, normals, size_m)).collect()
}

fn normals_of(cloud: &Cloud) -> Result<Cow<'_, [Vector3<f64>]>> {
    match &cloud.normals {
        Some(normals) => Ok(Cow::Borrowed(normals)),
        None => Ok(Cow::Owned(unorganised_normals(&cloud.points, &UnorganisedNormalOptions::default())?)),
    }
}

/// Verdicts on the stations at the adjusted poses, their points where the shared parameters have them.
fn placements(stations: &[Cloud], points: &[StationPoints], state: &State) -> Result<Placements> {
    if state.parameters.is_empty() {
        return judge_placements(stations, &state.poses);
    }
    let modelled: Vec<Cloud> = stations.iter().zip(points).map(|(cloud, points)| points.modelled(cloud)).collect();
    judge_placements(&modelled, &state.poses)
}

fn result(
    checked: Checked,
    adjusted: Adjusted,
    start: &[Isometry3<f64>],
    network: &Network<'_>,
    datum: Datum,
    size_m: f64,
) -> StationRegistration {
    let count = adjusted.state.poses.len();
    let parameters = adjusted.state.parameters.len();
    let (redundancy, sigma0) = (adjusted.redundancy(), adjusted.sigma0());
    let factor = 0.5 * adjusted.variance_factor();
    let covariance = factor * (&adjusted.cofactors + adjusted.cofactors.transpose());
    let undetermined = undetermined(&adjusted.state.poses, &covariance, network.hold_m, size_m);
    let surfaces = adjusted.overlaps(FEWEST_CONTACTS).iter().map(|overlap| surface_pair(&adjusted, overlap)).collect();
    let (poses, joint) = datum.apply(start, adjusted.state.poses, covariance, network.hold_m);
    StationRegistration {
        covariance: (0..count).map(|k| joint.fixed_view::<6, 6>(6 * k, 6 * k).into_owned()).collect(),
        world_from_station: poses,
        pairs: checked.pairs,
        refused: checked.refused,
        loops: checked.loops,
        surfaces,
        placements: Placements::default(),
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

/// The state with what is undetermined of the stations as it was at the start; `None` where all is determined.
fn returned(adjusted: &Adjusted, start: &[Isometry3<f64>], network: &Network<'_>, size_m: f64) -> Option<State> {
    let mut state = adjusted.state.clone();
    let mut any = false;
    for (k, (pose, start)) in state.poses.iter_mut().zip(start).enumerate().filter(|(k, _)| *k != network.fixed) {
        let own: Matrix6<f64> = adjusted.cofactors.fixed_view::<6, 6>(6 * k, 6 * k).into_owned();
        if let Some(back) = precision::returned(pose, start, &own, network.hold_m, size_m) {
            *pose = back;
            any = true;
        }
    }
    any.then_some(state)
}

fn undetermined(
    poses: &[Isometry3<f64>],
    covariance: &DMatrix<f64>,
    hold_m: f64,
    size_m: f64,
) -> Vec<UndeterminedStation> {
    let motions = poses.iter().enumerate().map(|(station, pose)| {
        let own: Matrix6<f64> = covariance.fixed_view::<6, 6>(6 * station, 6 * station).into_owned();
        UndeterminedStation { station, motions: precision::undetermined(pose, &own, hold_m, size_m) }
    });
    motions.filter(|station| !station.motions.is_empty()).collect()
}

fn surface_pair(adjusted: &Adjusted, overlap: &Overlap) -> SurfacePair {
    let Overlap { target, source, fraction } = *overlap;
    let eye = adjusted.state.poses[target].translation.vector;
    let count = adjusted.state.poses.len();
    let tiles = adjusted.shared(target, source);
    let (mut weight, mut mean, mut square, mut whitened, mut outliers) = (0.0, 0.0, 0.0, 0.0, 0_usize);
    for tile in &tiles {
        let shared_plane = &adjusted.shared_planes[tile.shared_plane];
        let weight_of = |station: usize| adjusted.scatter.weights[tile.target.tile * count + station];
        let robust = weight_of(target).min(weight_of(source));
        let own = robust * tile.weight();
        // Along the normal that points to the target station, so that the sign means nearer or farther.
        let facing = shared_plane.normal.dot(&(eye - shared_plane.origin)) >= 0.0;
        weight += own;
        mean += own * if facing { tile.apart_m() } else { -tile.apart_m() };
        square += own * tile.apart_m().powi(2);
        whitened += own * tile.weight() * tile.apart_m().powi(2);
        outliers += usize::from(robust < 0.1);
    }
    let of = |sum: f64| if weight > 0.0 { sum / weight } else { 0.0 };
    SurfacePair {
        target,
        source,
        overlap: fraction,
        contacts: tiles.len(),
        mean_m: of(mean),
        rms_m: of(square).sqrt(),
        rms_sigma: of(whitened).sqrt(),
        outliers: outliers as f64 / tiles.len().max(1) as f64,
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
