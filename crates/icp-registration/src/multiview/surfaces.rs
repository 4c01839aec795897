//! All stations at once from their surfaces: pairs aligned anew from the adjusted poses until nothing moves.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::{Isometry3, Matrix6, Vector6};
use rayon::prelude::*;

use super::overlap::{Overlap, find_overlaps};
use super::pose_graph::{Datum, PairConstraint, StationAdjustment, StationAdjustmentOptions, adjust_stations};
use crate::error::{Error, Result};
use crate::icp::{IcpOptions, IcpResult, IcpTarget, Selection, StopReason};

/// Options of [`adjust_surfaces`].
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceAdjustmentOptions {
    /// How each pair is aligned.
    pub icp: IcpOptions,
    /// Distance within which points count as overlapping, metre: about the error of the initial poses.
    pub overlap_distance_m: f64,
    /// Pairs with less overlap are left out. Default 0.3.
    pub minimum_overlap: f64,
    /// Partners that each station is held to, those with the most overlap. Default 2: a round or a strip of stations. Thin
    /// overlaps at the rim of the views are biased by more than their covariance tells, so more pairs are not better.
    pub partners_per_station: usize,
    /// Pairs of which a smaller fraction of the points has a partner after the alignment are left out: what few points
    /// at the rim of a view say is biased by more than their covariance tells. Default 0.1.
    pub minimum_partners: f64,
    /// Rounds of alignment and adjustment. Default 3.
    pub max_rounds: usize,
    /// The rounds end when no station moves by more than this, metre. Default 0.1 mm.
    pub tolerance_m: f64,
    /// Distance of a relative pose from the adjusted ones, in its own standard deviations (Mahalanobis, six components),
    /// beyond which the pair is left out. Default 8: no right pair is that far, errors in common included.
    pub rejection_distance: f64,
    /// How the relative poses are adjusted.
    pub adjustment: StationAdjustmentOptions,
}

impl SurfaceAdjustmentOptions {
    /// Options for initial poses that are right to about this distance, metre.
    pub fn with_initial_error(distance_m: f64) -> Self {
        // A third of the points carries nearly all that a frame says about a pose, since neighbours share their errors.
        let icp = IcpOptions {
            initial_correspondence_distance_m: Some(distance_m),
            selection: Selection::EveryNth(3),
            step_tolerance_m: Some(5e-5),
            ..IcpOptions::default()
        };
        Self {
            icp,
            overlap_distance_m: distance_m,
            minimum_overlap: 0.3,
            partners_per_station: 2,
            minimum_partners: 0.1,
            max_rounds: 3,
            tolerance_m: 1e-4,
            rejection_distance: 8.0,
            adjustment: StationAdjustmentOptions::default(),
        }
    }
}

/// Two stations brought together.
#[derive(Debug, Clone, PartialEq)]
pub struct PairAlignment {
    /// Index of the target station.
    pub target: usize,
    /// Index of the source station.
    pub source: usize,
    /// The alignment of the last round.
    pub result: IcpResult,
}

/// Two stations that overlap and could not be aligned.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RefusedPair {
    /// Index of the target station.
    pub target: usize,
    /// Index of the source station.
    pub source: usize,
    /// Why.
    pub reason: String,
}

/// All stations, with the pairs that carried them.
#[derive(Debug, Clone)]
pub struct SurfaceAdjustment {
    /// Poses, covariances and residuals of the pairs.
    pub stations: StationAdjustment,
    /// The pairs, in the order of `stations.residuals`.
    pub pairs: Vec<PairAlignment>,
    /// Pairs that were left out in the last round.
    pub refused: Vec<RefusedPair>,
    /// Rounds that were needed.
    pub rounds: usize,
}

/// Aligns all overlapping pairs, adjusts all stations, and repeats from the adjusted poses until no station moves.
///
/// Each pair enters as a relative pose with the full covariance that its surfaces give: a direction in which two
/// stations slide on each other has no weight there and takes its value from other pairs. `progress(done, total)` is
/// told the pairs done in each round.
///
/// # Errors
/// Those of [`find_overlaps`] and [`adjust_stations`].
pub fn adjust_surfaces(
    stations: &[IcpTarget],
    initial_world_from_station: &[Isometry3<f64>],
    datum: Datum,
    options: &SurfaceAdjustmentOptions,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<SurfaceAdjustment> {
    let mut poses = initial_world_from_station.to_vec();
    let spacing_m = stations.iter().map(IcpTarget::spacing_m).fold(0.0, f64::max);
    let mut icp = options.icp.clone();
    let mut overlap_distance_m = options.overlap_distance_m;
    let mut round = 1;
    loop {
        let overlaps = find_overlaps(stations, &poses, overlap_distance_m)?;
        let (least, partners) = (options.minimum_overlap, options.partners_per_station);
        let candidates = best_partners(&overlaps, stations.len(), least, partners);
        let (aligned, mut refused) = align_pairs(stations, &poses, &candidates, &icp, progress);
        let enough = |pair: &PairAlignment| pair.result.overlap >= options.minimum_partners;
        let (mut pairs, thin): (Vec<_>, Vec<_>) = aligned.into_iter().partition(enough);
        refused.extend(thin.iter().map(without_partners));
        // Poses that bring partners within the distance are themselves good to a fraction of it.
        let started = |pairs: &[PairAlignment]| constraints(stations, pairs, overlap_distance_m / 5.0);
        let adjusted = adjust_without_gross_errors(&mut pairs, &mut refused, &poses, datum, options, &started)?;
        let moved = poses.iter().zip(&adjusted.world_from_station);
        let largest = moved.map(|(a, b)| (a.translation.vector - b.translation.vector).norm()).fold(0.0, f64::max);
        if largest <= options.tolerance_m || round >= options.max_rounds {
            return Ok(SurfaceAdjustment { stations: adjusted, pairs, refused, rounds: round });
        }
        poses = adjusted.world_from_station;
        // The poses are much better now: near partners suffice, and far ones could only mislead.
        let near = (options.overlap_distance_m / 4.0).max(2.0 * spacing_m);
        overlap_distance_m = near;
        icp.initial_correspondence_distance_m = Some(near);
        round += 1;
    }
}

pub(super) fn without_partners(pair: &PairAlignment) -> RefusedPair {
    let reason = format!("only {:.0} % of the points have a partner", 100.0 * pair.result.overlap);
    RefusedPair { target: pair.target, source: pair.source, reason }
}

/// Adjusts, leaves out the pair that contradicts the others most, and adjusts again until none does.
///
/// One at a time, since one wrong pair makes its neighbours look wrong as well. A pair that alone connects stations
/// stays: nothing contradicts it.
fn adjust_without_gross_errors(
    pairs: &mut Vec<PairAlignment>,
    refused: &mut Vec<RefusedPair>,
    poses: &[Isometry3<f64>],
    datum: Datum,
    options: &SurfaceAdjustmentOptions,
    constraints: &dyn Fn(&[PairAlignment]) -> Vec<PairConstraint>,
) -> Result<StationAdjustment> {
    let mut adjusted = adjust_stations(&constraints(pairs), poses, datum, &options.adjustment)?;
    loop {
        let residuals = adjusted.residuals.iter().map(|residual| residual.mahalanobis);
        let worst = residuals.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        let Some((index, distance)) = worst.filter(|(_, distance)| *distance > options.rejection_distance) else {
            return Ok(adjusted);
        };
        let pair = pairs.remove(index);
        if let Ok(without) = adjust_stations(&constraints(pairs), poses, datum, &options.adjustment) {
            adjusted = without;
        } else {
            pairs.insert(index, pair);
            return Ok(adjusted);
        }
        let reason = format!("contradicts the other pairs by {distance:.1} standard deviations");
        refused.push(RefusedPair { target: pair.target, source: pair.source, reason });
    }
}

/// The pairs as observations. What a pair leaves undetermined is known at least as well as the poses it started from:
/// information of `started_within_m` is added, for rotations at the radius of the target.
fn constraints(stations: &[IcpTarget], pairs: &[PairAlignment], started_within_m: f64) -> Vec<PairConstraint> {
    let constraint = |pair: &PairAlignment| {
        let lever_m = stations[pair.target].radius_m.max(f64::MIN_POSITIVE);
        let prior = Vector6::from_fn(|row, _| (if row < 3 { 1.0 } else { lever_m } / started_within_m).powi(2));
        let information = pair.result.covariance.try_inverse().unwrap_or_else(Matrix6::zeros);
        let with_prior = information + Matrix6::from_diagonal(&prior);
        PairConstraint {
            target: pair.target,
            source: pair.source,
            target_from_source: pair.result.target_from_source,
            covariance: with_prior.try_inverse().map_or(pair.result.covariance, |c| 0.5 * (c + c.transpose())),
        }
    };
    pairs.iter().map(constraint).collect()
}

/// Pairs of target and source that are among the best partners of either, in ascending order.
pub(super) fn best_partners(
    overlaps: &[Overlap],
    stations: usize,
    minimum_overlap: f64,
    partners_per_station: usize,
) -> Vec<(usize, usize)> {
    let enough: Vec<&Overlap> = overlaps.iter().filter(|o| o.fraction >= minimum_overlap).collect();
    let mut chosen = BTreeSet::new();
    for station in 0..stations {
        let mut partners: Vec<&&Overlap> =
            enough.iter().filter(|o| o.target == station || o.source == station).collect();
        // Stable: equal overlaps stay in the order of the stations.
        partners.sort_by(|a, b| b.fraction.total_cmp(&a.fraction));
        chosen.extend(partners.iter().take(partners_per_station).map(|o| (o.target, o.source)));
    }
    chosen.into_iter().collect()
}

/// Aligns pairs of stations, `candidates` being indices of target and source, from the given poses.
///
/// A pair that can't be aligned, or does not settle, is listed with its reason: it is no failure as long as others
/// connect its stations. Indices out of range are refused the same way.
pub fn align_pairs(
    stations: &[IcpTarget],
    world_from_station: &[Isometry3<f64>],
    candidates: &[(usize, usize)],
    icp: &IcpOptions,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> (Vec<PairAlignment>, Vec<RefusedPair>) {
    let finished = AtomicUsize::new(0);
    let align = |&(target, source): &(usize, usize)| {
        let result = guess(stations, world_from_station, target, source)
            .and_then(|guess| align_pair(stations, target, source, &guess, icp));
        progress(finished.fetch_add(1, Ordering::Relaxed) + 1, candidates.len());
        result
    };
    // Collected in the order of the candidates, so that the number of threads does not matter.
    sorted_out(candidates, candidates.par_iter().map(align).collect())
}

/// Alignments that settled, and those that did not, with the reason.
pub(super) fn sorted_out(
    candidates: &[(usize, usize)],
    results: Vec<Result<IcpResult>>,
) -> (Vec<PairAlignment>, Vec<RefusedPair>) {
    let (mut pairs, mut refused) = (Vec::new(), Vec::new());
    for (&(target, source), result) in candidates.iter().zip(results) {
        match result {
            Ok(result) if result.stop == StopReason::MaxIterations => {
                let reason = format!("not settled after {} iterations", result.iterations);
                refused.push(RefusedPair { target, source, reason });
            }
            Ok(result) => pairs.push(PairAlignment { target, source, result }),
            Err(error) => refused.push(RefusedPair { target, source, reason: error.to_string() }),
        }
    }
    (pairs, refused)
}

fn guess(
    stations: &[IcpTarget],
    world_from_station: &[Isometry3<f64>],
    target: usize,
    source: usize,
) -> Result<Isometry3<f64>> {
    let count = stations.len().min(world_from_station.len());
    match [target, source].into_iter().find(|station| *station >= count) {
        Some(station) => Err(Error::NoSuchStation { station, count }),
        None => Ok(world_from_station[target].inverse() * world_from_station[source]),
    }
}

pub(super) fn align_pair(
    stations: &[IcpTarget],
    target: usize,
    source: usize,
    guess: &Isometry3<f64>,
    icp: &IcpOptions,
) -> Result<IcpResult> {
    stations[target].align(stations[source].cloud(), guess, icp)
}
