//! Registration of all stations: from clouds to one coordinate system.

use std::sync::Arc;

use nalgebra::Isometry3;

use crate::adjustment::joint_covariance::JointCovariance;
use crate::adjustment::network::{Network, State};
use crate::adjustment::precision;
use crate::adjustment::rounds::FEWEST_CONTACTS;
use crate::adjustment::simultaneous::Adjusted;
use crate::agreement::alignments::{Overlap, PairAlignment};
use crate::agreement::loops::{LoopClosure, reached};
use crate::agreement::placement::{Placements, judge_placements};
use crate::error::{Error, Result};
use crate::relative_pose::check_poses;
use crate::surfaces::point_model::SharedParameters;
use crate::surfaces::points::StationPoints;
use crate::survey::datum::Datum;
use crate::survey::registration::{
    Effort, Start, StationRegistration, StationRegistrationOptions, SurfacePair, UndeterminedStation,
};
use crate::survey::together::{Brought, brought_together, is_whole};
use point_cloud::Cloud;
use rigid_pose::{InputError, require_option, require_positive};

/// Most stations at once from approximate poses. In buildings of so many (see docs/benchmarks.md) all come into their places, or are
/// named; of more that has not been shown.
const MOST_STATIONS: usize = 1_000;
/// Most stations without approximate poses: each is tried against all placed before, which takes hours of more.
const MOST_ARRANGED: usize = 200;

/// Brings the clouds of many stations into one coordinate system.
///
/// Wide rounds bring the stations together where patches of their surfaces meet, all overlaps in one system with contacts
/// found anew in each round (`[ChenMedioni1992]`, `[Pulli1999]`). The last rounds take all points: each station's pieces of
/// a surface are joined to shared planes, whose planes are unknown too and eliminated exactly. Then loops of
/// pairs are closed. `progress(done, total)` is told the rounds of each part.
///
/// Clouds without normals get them from their nearest neighbours.
///
/// # Errors
/// [`Error::UnconnectedStations`] names stations that no pair leads to; [`Error::TooManyStations`]; [`InputError::Empty`],
/// [`InputError::LengthMismatch`], [`InputError::NonFinite`], [`InputError::NotPositive`], [`Error::NoSuchStation`],
/// [`InputError::InvalidOption`] for the input; [`InputError::Numerical`] where shared parameters are not determined.
pub fn register_stations(
    stations: &[Cloud],
    start: Start<'_>,
    datum: Datum,
    options: &StationRegistrationOptions<'_>,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<StationRegistration> {
    validate(stations, start, datum, options)?;
    let whole = is_whole(stations.len(), start, options);
    let Brought { adjusted, start, points, placements: judged, prepared, network, patch_m } =
        brought_together(stations, start, datum, (options, whole), progress)?;
    require_connected(&adjusted, datum)?;
    let placements = judged.map_or_else(|| placements(stations, points, &adjusted.state), Ok)?;
    let alone = adjusted.alone(options.minimum_overlap, datum.held_station(), (network.hold_m, patch_m))?;
    let result = result(alone, adjusted, &start, &network, datum, patch_m);
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
        return Err(InputError::Empty { what: "the list of stations" }.into());
    }
    stations.iter().try_for_each(|cloud| cloud.validate("the cloud of a station"))?;
    if let Start::Poses(poses) = start {
        check_poses("poses of the stations", stations.len(), poses)?;
    }
    require_few(stations.len(), start, options)?;
    let (station, count) = (datum.held_station(), stations.len());
    if station >= count {
        return Err(Error::NoSuchStation { station, count });
    }
    options.turns.iter().try_for_each(|turn| turn.check(count))?;
    require_positive("start_error_m", options.start_error_m)?;
    require_positive("patch_m", options.patch_m)?;
    Ok(require_option("minimum_overlap", options.minimum_overlap, "0 to 1", |share| (0.0..=1.0).contains(&share))?)
}

/// Refuses what would come out wrong somewhere, or take hours. Shared parameters couple all stations: then they are adjusted as few are.
fn require_few(found: usize, start: Start<'_>, options: &StationRegistrationOptions<'_>) -> Result<()> {
    if options.model.is_some() {
        return Ok(());
    }
    let (most, start, remedy) = match start {
        Start::Poses(_) => (MOST_STATIONS, "approximate poses", "register parts of the survey that share stations"),
        Start::Order => (MOST_ARRANGED, "their order", "give approximate poses, or register parts of the survey"),
        Start::Nothing => (MOST_ARRANGED, "nothing else", "give approximate poses, or register parts of the survey"),
    };
    if found > most { Err(Error::TooManyStations { found, most, start, remedy }) } else { Ok(()) }
}

/// Verdicts on the stations at the adjusted poses, their points where the shared parameters have them.
fn placements(stations: &[Cloud], points: Vec<StationPoints>, state: &State) -> Result<Placements> {
    if state.parameters.is_empty() {
        drop(points);
        return judge_placements(stations, &state.poses);
    }
    let modelled: Vec<Cloud> = stations.iter().zip(&points).map(|(cloud, points)| points.modelled(cloud)).collect();
    judge_placements(&modelled, &state.poses)
}

fn result(
    (pairs, loops): (Vec<PairAlignment>, Vec<LoopClosure>),
    adjusted: Adjusted,
    start: &[Isometry3<f64>],
    network: &Network<'_>,
    datum: Datum,
    size_m: f64,
) -> StationRegistration {
    let count = adjusted.state.poses.len();
    let parameters = adjusted.state.parameters.len();
    let (redundancy, sigma0) = (adjusted.redundancy(), adjusted.sigma0());
    let joint = JointCovariance::new(adjusted.cofactors.clone(), adjusted.factor);
    let undetermined = undetermined(&adjusted.state.poses, &joint, network.hold_m, size_m);
    let surfaces = adjusted.overlaps(FEWEST_CONTACTS).iter().map(|overlap| surface_pair(&adjusted, overlap)).collect();
    let (poses, joint) = datum.apply(start, adjusted.state.poses, joint, network.hold_m);
    StationRegistration {
        covariance: (0..count).map(|k| joint.between(k, k)).collect(),
        world_from_station: poses,
        pairs,
        loops,
        surfaces,
        placements: Placements::default(),
        undetermined,
        sigma0,
        redundancy,
        rounds: adjusted.rounds,
        settled: adjusted.settled,
        effort: Effort { pairs_tried: adjusted.pairs_tried, filled_blocks: adjusted.cofactors.filled() },
        parameters: (parameters > 0).then(|| shared(network, &adjusted.state.parameters, &joint.whole())),
        joint_covariance: joint,
        prepared: Arc::default(),
    }
}

fn undetermined(
    poses: &[Isometry3<f64>],
    covariance: &JointCovariance,
    hold_m: f64,
    size_m: f64,
) -> Vec<UndeterminedStation> {
    let motions = poses.iter().enumerate().map(|(station, pose)| {
        let own = covariance.between(station, station);
        UndeterminedStation { station, motions: precision::undetermined(pose, &own, hold_m, size_m) }
    });
    motions.filter(|station| !station.motions.is_empty()).collect()
}

fn surface_pair(adjusted: &Adjusted, overlap: &Overlap) -> SurfacePair {
    let Overlap { target, source, fraction } = *overlap;
    let eye = adjusted.state.poses[target].translation.vector;
    let tiles = adjusted.shared(target, source);
    let (mut weight, mut mean, mut square, mut whitened, mut outliers) = (0.0, 0.0, 0.0, 0.0, 0_usize);
    for tile in &tiles {
        let shared_plane = &adjusted.shared_planes[tile.shared_plane];
        let robust = adjusted.scatter.weight(&tile.target).min(adjusted.scatter.weight(&tile.source));
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

fn shared(network: &Network<'_>, values: &[f64], joint: &nalgebra::DMatrix<f64>) -> SharedParameters {
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
        names: network.names.clone(),
        values: values.to_vec(),
        covariance: (0..m).map(|r| (0..m).map(|c| joint[(first + r, first + c)]).collect()).collect(),
        prior: network.prior.0.clone(),
        prior_sigma: network.prior.1.clone(),
        significance: (0..m).map(significance).collect(),
        largest_pose_correlation: (0..m).map(largest).collect(),
    }
}
