//! Whether targets that are known by their names alone have the right ones: by the geometry of all stations that see them.
//!
//! A target under the name of another lies off its epipolar lines, and off the point that the other stations put that one at. The
//! network of all stations is oriented without it ([`orient_network`](crate::orient_network) leaves out what contradicts); then each
//! image point is held against what all other observations say, with the covariance of both.

use std::collections::{BTreeMap, BTreeSet};

use camera_model::Camera;
use statistics::{CHI_MEDIANS, Distribution, bonferroni, upper_median};

use crate::relative::minima;
use crate::{Error, NetworkOptions, Result, TieObservation};

/// How to check names.
#[derive(Debug, Clone, PartialEq)]
pub struct NameCheckOptions {
    /// Probability that any right name of the survey is doubted, for image points that scatter as stated. Default: 0.001.
    pub level: f64,
    /// Targets that a station must share with others to be judged: with five, one that is wrong may bend the pose until it fits.
    /// Default: 6.
    pub least_targets: usize,
    /// Seed of the choice of samples of two views. Default 0.
    pub seed: u64,
}

impl Default for NameCheckOptions {
    fn default() -> Self {
        Self { level: 1e-3, least_targets: 6, seed: 0 }
    }
}

/// What the geometry says of the name of one observed target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NameVerdict {
    /// The other stations that see the target agree.
    Agrees,
    /// They do not.
    Contradicts {
        /// By how much, in standard deviations of an image point against what all others say.
        deviations: f64,
        /// What right names exceed with the probability of the options.
        limit: f64,
        /// Whether two other stations or more agree on the target, so that the wrong name is this one; else it is this one or that of
        /// another station, and all observations of the target are told.
        is_alone: bool,
    },
    /// Nothing tells: no other station sees the target, too few targets are shared, or the stations cannot be oriented.
    Open,
}

/// Checks the names of targets that nobody has coordinates of, by the relative orientation of the stations that see them. Stations and
/// targets are numbered from 0; a verdict for each observation, in their order. Stations that share targets with some of the others
/// only make networks of their own.
///
/// Two stations without ranges check a target across its epipolar line only. The standard deviations must cover what the camera's
/// lens is not known by; where the scatter of most image points is larger than they say, it is what counts. A range that contradicts its
/// image point alone is no wrong name.
///
/// # Errors
/// [`Error::InvalidNumber`], [`Error::InvalidTarget`] and [`Error::Camera`]: what is wrong with the numbers. Stations that cannot be
/// oriented are no error.
pub fn check_names(
    camera: &Camera,
    observations: &[TieObservation],
    options: &NameCheckOptions,
) -> Result<Vec<NameVerdict>> {
    let mut verdicts = vec![NameVerdict::Open; observations.len()];
    let mut open: BTreeSet<usize> = observations.iter().map(|seen| seen.station).collect();
    while open.len() >= 2 {
        let Some((judged, group)) = largest(camera, observations, open.clone(), options)? else { break };
        open.retain(|station| !group.contains(station));
        for (index, verdict) in judged {
            verdicts[index] = verdict;
        }
    }
    Ok(verdicts)
}

type Judged = (Vec<(usize, NameVerdict)>, BTreeSet<usize>);

/// Verdicts of the stations among these that can be oriented to each other; `None` where no two can.
fn largest(
    camera: &Camera,
    observations: &[TieObservation],
    mut stations: BTreeSet<usize>,
    options: &NameCheckOptions,
) -> Result<Option<Judged>> {
    let network = NetworkOptions { seed: options.seed, ..NetworkOptions::default() };
    loop {
        let kept = shared(observations, &mut stations, options.least_targets);
        if stations.len() < 2 {
            return Ok(None);
        }
        let numbered = renumbered(observations, &kept);
        match minima(camera, &numbered, &network) {
            Ok(found) => {
                // Where several poses explain the image points alike, as of targets in one plane, names fit all of them alike.
                let misfits = found[0].misfits(&numbered)?;
                let verdicts = judge(&numbered, &misfits, options.level);
                return Ok(Some((kept.into_iter().zip(verdicts).collect(), stations)));
            }
            Err(Error::NotConnected { station, .. }) => {
                // Its number among the stations that were tried.
                let Some(&lost) = stations.iter().nth(station) else { return Ok(None) };
                stations.remove(&lost);
            }
            Err(error @ (Error::InvalidNumber { .. } | Error::InvalidTarget { .. } | Error::Camera(_))) => {
                return Err(error);
            }
            Err(_) => return Ok(None),
        }
    }
}

/// The observations of targets that two of the stations share; drops stations that have too few of them.
fn shared(observations: &[TieObservation], stations: &mut BTreeSet<usize>, least: usize) -> Vec<usize> {
    loop {
        let mut by_target: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
        for seen in observations.iter().filter(|seen| stations.contains(&seen.station)) {
            by_target.entry(seen.target).or_default().insert(seen.station);
        }
        let is_shared = |seen: &TieObservation| {
            stations.contains(&seen.station) && by_target.get(&seen.target).is_some_and(|by| by.len() >= 2)
        };
        let kept: Vec<usize> = (0..observations.len()).filter(|&index| is_shared(&observations[index])).collect();
        let count = |station: &usize| kept.iter().filter(|&&index| observations[index].station == *station).count();
        let before = stations.len();
        stations.retain(|station| count(station) >= least);
        if stations.len() == before {
            return kept;
        }
    }
}

/// Some of the observations, with stations and targets numbered from 0 in their order.
fn renumbered(observations: &[TieObservation], kept: &[usize]) -> Vec<TieObservation> {
    let places = |number: fn(&TieObservation) -> usize| -> BTreeMap<usize, usize> {
        let all: BTreeSet<usize> = kept.iter().map(|&index| number(&observations[index])).collect();
        all.into_iter().enumerate().map(|(place, number)| (number, place)).collect()
    };
    let (stations, targets) = (places(|seen| seen.station), places(|seen| seen.target));
    let moved = |&index: &usize| {
        let seen = observations[index];
        TieObservation { station: stations[&seen.station], target: targets[&seen.target], ..seen }
    };
    kept.iter().map(moved).collect()
}

fn judge(observations: &[TieObservation], misfits: &[Option<[f64; 2]>], level: f64) -> Vec<NameVerdict> {
    let mut sizes: Vec<f64> = misfits.iter().flatten().flatten().filter(|w| w.is_finite()).map(|w| w.abs()).collect();
    let critical = Distribution::Normal.critical(bonferroni(level, sizes.len()));
    // A lens that is known less well than stated moves most image points, a wrong name its own.
    let limit = critical * (upper_median(&mut sizes) / CHI_MEDIANS[0]).max(1.0);
    let size = |both: &[f64; 2]| both.iter().filter(|w| w.is_finite()).fold(0.0_f64, |size, w| size.max(w.abs()));
    let mut verdicts: Vec<NameVerdict> = misfits
        .iter()
        .map(|misfit| match misfit.as_ref().map(size) {
            None => NameVerdict::Open,
            Some(deviations) if deviations > limit => NameVerdict::Contradicts { deviations, limit, is_alone: true },
            Some(_) => NameVerdict::Agrees,
        })
        .collect();
    let mut of_target: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (index, seen) in observations.iter().enumerate() {
        of_target.entry(seen.target).or_default().push(index);
    }
    for own in of_target.values() {
        let worst = own.iter().filter_map(|&index| match verdicts[index] {
            NameVerdict::Contradicts { deviations, .. } => Some(deviations),
            _ => None,
        });
        let Some(deviations) = worst.max_by(f64::total_cmp) else { continue };
        let agreeing = own.iter().filter(|&&index| verdicts[index] == NameVerdict::Agrees).count();
        if agreeing < 2 {
            for &index in own {
                verdicts[index] = NameVerdict::Contradicts { deviations, limit, is_alone: false };
            }
        }
    }
    verdicts
}
