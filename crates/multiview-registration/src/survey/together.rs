//! All stations adjusted, from what is known of them: wide rounds, the last rounds, and those again that fit better elsewhere.

use std::borrow::Cow;

use nalgebra::{Isometry3, Vector3};
use rayon::prelude::*;
use statistics::upper_median;

use crate::adjustment::known::Known;
use crate::adjustment::network::{Network, State};
use crate::adjustment::precision;
use crate::adjustment::rounds::{Surfaces, WideRounds};
use crate::adjustment::simultaneous::{Adjusted, Finish, most_rounds};
use crate::agreement::placement::{ONE_ROOM, Placements, judge_placements};
use crate::error::Result;
use crate::places::search::Places;
use crate::surfaces::patch_size;
use crate::surfaces::patches::Surface;
use crate::surfaces::point_model::checked_prior;
use crate::surfaces::points::StationPoints;
use crate::survey::datum::Datum;
use crate::survey::registration::{Start, StationRegistrationOptions};
use point_cloud::Cloud;
use point_cloud::{UnorganisedNormalOptions, unorganised_normals};

/// How often those of many stations that fit better elsewhere are put there.
const AGAIN: usize = 4;
/// Default of the error of approximate poses, in radii of the clouds.
const START_ERROR: f64 = 0.2;
/// Part of a patch by which what planes leave open is held in the last rounds, which find their way from there.
const NEAR: f64 = 0.5;
/// The rounds end when no station moves by more than a patch over this: some hundredths of a millimetre.
const TOLERANCE: f64 = 2000.0;

/// Whether stations are adjusted as few are: all held against each other. Shared parameters couple them, and stations that were arranged by what
/// they saw are not off each by itself.
pub(crate) fn is_whole(stations: usize, start: Start<'_>, options: &StationRegistrationOptions<'_>) -> bool {
    options.model.is_some() || stations <= ONE_ROOM || !matches!(start, Start::Poses(_))
}

/// All stations adjusted, before anything is judged.
pub(crate) struct Brought<'a> {
    pub adjusted: Adjusted,
    /// The poses that they began at.
    pub start: Vec<Isometry3<f64>>,
    pub points: Vec<StationPoints>,
    /// Verdicts on the stations where they are, if that was asked.
    pub placements: Option<Placements>,
    pub prepared: Vec<Surface>,
    pub network: Network<'a>,
    pub patch_m: f64,
}

/// Adjusts all stations from what is known of them.
pub(crate) fn brought_together<'a>(
    stations: &[Cloud],
    start: Start<'_>,
    datum: Datum,
    (options, whole): (&StationRegistrationOptions<'a>, bool),
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Brought<'a>> {
    let surfaces = prepare(stations, options)?;
    let patch_m = surfaces[0].size_m;
    let radius_m = surfaces.iter().map(|surface| surface.radius_m).fold(0.0, f64::max);
    let start = match start {
        Start::Poses(poses) => poses.to_vec(),
        _ => crate::survey::blind::arranged(stations, start, datum.held_station(), options.turns)?,
    };
    // Stations that were arranged by what they saw may have slid along walls together: they are not known better.
    let reach_m = options.start_error_m.unwrap_or(START_ERROR * radius_m);
    let (prior, names) = match options.model {
        Some(model) => (checked_prior(model)?, model.names()),
        None => Default::default(),
    };
    let fixed = datum.held_station();
    let network = Network { fixed, hold_m: radius_m, names, prior, turns: options.turns, whole };
    let total = |done| progress(done, most_rounds(whole));
    let wide_rounds = WideRounds { network: &network, reach_m, progress: &total };
    let mut modelled = Surfaces::fixed(surfaces.iter().collect());
    modelled.model = options.model.map(|model| (model, stations.iter().map(Cloud::len).collect()));
    let mut near =
        wide_rounds.run(&mut modelled, &State { poses: start.clone(), parameters: network.prior.0.clone() })?;
    let moved = if whole { Isometry3::identity() } else { framed(&mut near, network.fixed, &start[network.fixed]) };
    let mut finish = Finish {
        network: &network,
        near: Known::at(NEAR * patch_m, radius_m),
        tolerance_m: patch_m / TOLERANCE,
        progress: &total,
        joints: Vec::new(),
    };
    let mut points: Vec<StationPoints> =
        stations.par_iter().zip(&surfaces).map(|(cloud, surface)| StationPoints::new(cloud, surface)).collect();
    let mut adjusted = finish.run(&mut modelled, &mut points, near)?;
    let mut placements = None;
    if whole {
        if let Some(state) = returned(&adjusted, &start, &network, patch_m) {
            // Wide rounds may have moved stations where noise alone told them to.
            adjusted = finish.run(&mut modelled, &mut points, state)?;
        }
    } else {
        let begun: Vec<Isometry3<f64>> = start.iter().map(|pose| moved * pose).collect();
        let again = Again { stations, start: &begun, patch_m, reach_m };
        (adjusted, placements) = again.settled(adjusted, &mut finish, &mut modelled, &mut points)?;
    }
    let prepared = match modelled.modelled {
        Some((modelled, _)) => modelled,
        None => surfaces,
    };
    adjusted.factor = adjusted.factor_of_wide_errors();
    Ok(Brought { adjusted, start, points, placements, prepared, network, patch_m })
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

/// How those of many stations that are not in their places are sought again.
struct Again<'a> {
    stations: &'a [Cloud],
    /// Where they began, in the present frame.
    start: &'a [Isometry3<f64>],
    patch_m: f64,
    reach_m: f64,
}

impl Again<'_> {
    /// Adjusts until no station fits better elsewhere, and verdicts on where they are then.
    fn settled(
        &self,
        mut adjusted: Adjusted,
        finish: &mut Finish<'_>,
        modelled: &mut Surfaces<'_>,
        points: &mut [StationPoints],
    ) -> Result<(Adjusted, Option<Placements>)> {
        let mut last = None;
        for again in 0..=AGAIN {
            let places = Places::new(&adjusted, points, self.start, finish.network, (self.patch_m, self.reach_m));
            let mut poses = adjusted.state.poses.clone();
            let (moved, is_new) = places.improved(&mut poses, &mut finish.joints, last.as_ref())?;
            if (moved.is_empty() && !is_new && adjusted.settled) || again == AGAIN {
                let mut placements = judge_placements(self.stations, &adjusted.state.poses)?;
                let doubtful = places.looked_through.doubtful(&adjusted.state.poses);
                placements.doubt(moved.into_iter().chain(doubtful));
                return Ok((adjusted, Some(placements)));
            }
            let mut state = State { poses, ..adjusted.state.clone() };
            let fixed = finish.network.fixed;
            framed(&mut state, fixed, &adjusted.state.poses[fixed]);
            adjusted = finish.run(modelled, points, state)?;
            last = Some(moved);
        }
        Ok((adjusted, None))
    }
}

/// Moves all stations so that one has its pose, and says by what.
fn framed(state: &mut State, station: usize, pose: &Isometry3<f64>) -> Isometry3<f64> {
    if state.poses[station] == *pose {
        return Isometry3::identity();
    }
    let moved = pose * state.poses[station].inverse();
    for own in &mut state.poses {
        *own = moved * *own;
        own.rotation.renormalize();
    }
    state.poses[station] = *pose;
    moved
}

/// The state with what is undetermined of the stations as it was at the start; `None` where all is determined.
fn returned(adjusted: &Adjusted, start: &[Isometry3<f64>], network: &Network<'_>, size_m: f64) -> Option<State> {
    let mut state = adjusted.state.clone();
    let mut any = false;
    for (k, (pose, start)) in state.poses.iter_mut().zip(start).enumerate().filter(|(k, _)| *k != network.fixed) {
        if let Some(back) = precision::returned(pose, start, &adjusted.cofactors.of(k), network.hold_m, size_m) {
            *pose = back;
            any = true;
        }
    }
    any.then_some(state)
}

#[cfg(test)]
#[path = "../../tests/inside/networks.rs"]
mod tests;
