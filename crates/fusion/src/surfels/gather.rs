//! Points to places, twice: first by the planes of single frames, then by those of all.

use nalgebra::Vector3;
use rayon::prelude::*;
use statistics::Distribution;

use super::assign::{Owner, Places, members, owners};
use super::curvature::{Bend, largest_off};
use super::estimate::{Alone, Estimate, estimate};
use crate::input::Observations;
use crate::patches::{Patches, Seed};
use crate::small;
use crate::{Error, FusionOptions, Result};

/// Fewest points of a place with a weak plane: they must tell whether it is theirs.
const FEWEST_OF_WEAK: usize = 2;

/// Places with their planes and points.
pub(crate) struct Gathered {
    /// Cell and place, with the plane that points were chosen by.
    pub seeds: Vec<(u64, Seed)>,
    pub estimates: Vec<Estimate>,
    /// Points of each place, in their order.
    pub members: Vec<Vec<u32>>,
    /// Owner of each point.
    pub owners: Vec<Owner>,
}

/// Gathers the points of seeds. Places with too few points are given up after the first round, so that their points find others.
pub(crate) fn gather(
    observations: &Observations,
    patches: &Patches,
    seeds: &[(u64, Seed)],
    layers: &[u32],
    gate: f64,
) -> Gathered {
    let owners = owners(observations, patches, &Places::new(seeds), layers, gate);
    let estimates = estimates(observations, seeds, &owners);
    // A place whose points may all be those of another surface still keeps that one from them.
    let mut is_claimed = vec![false; seeds.len()];
    for owner in &owners {
        if let Owner::Either(first, second) = owner {
            is_claimed[*first as usize] = true;
            is_claimed[*second as usize] = true;
        }
    }
    let refined = |((key, seed), (place, is_claimed)): (&(u64, Seed), (&Option<Estimate>, bool))| {
        let Some(place) = place else { return is_claimed.then_some((*key, *seed)) };
        let cell = patches.cells.find(*key);
        let patch = cell.and_then(|cell| patches.by_frame(cell, seed.frame));
        let common = patch.map_or(seed.common, |patch| small::quadratic(&patch.common, &place.normal));
        Some((*key, place.seed(seed, common)))
    };
    let seeds: Vec<(u64, Seed)> = seeds.iter().zip(estimates.iter().zip(is_claimed)).filter_map(refined).collect();
    last(observations, patches, &seeds, layers, gate)
}

fn estimates(observations: &Observations, seeds: &[(u64, Seed)], owners: &[Owner]) -> Vec<Option<Estimate>> {
    let (starts, points) = members(owners, seeds.len());
    (0..seeds.len())
        .into_par_iter()
        .with_min_len(32)
        .map(|at| {
            let members = &points[starts[at] as usize..starts[at + 1] as usize];
            let seed = &seeds[at].1;
            let is_enough = !seed.is_weak || members.len() >= FEWEST_OF_WEAK;
            estimate(seed, members, &observations.all, &Alone).filter(|_| is_enough)
        })
        .collect()
}

fn last(observations: &Observations, patches: &Patches, seeds: &[(u64, Seed)], layers: &[u32], gate: f64) -> Gathered {
    let mut owners = owners(observations, patches, &Places::new(seeds), layers, gate);
    let (starts, points) = members(&owners, seeds.len());
    let of = |at: usize| &points[starts[at] as usize..starts[at + 1] as usize];
    let estimates = estimates(observations, seeds, &owners);
    let mut number = vec![u32::MAX; seeds.len()];
    let (mut kept, mut found, mut lists) = (Vec::new(), Vec::new(), Vec::new());
    for (at, estimate) in estimates.into_iter().enumerate() {
        let Some(estimate) = estimate else { continue };
        number[at] = kept.len() as u32;
        kept.push(seeds[at]);
        found.push(estimate);
        lists.push(of(at).to_vec());
    }
    for owner in &mut owners {
        *owner = renumbered(*owner, &number);
    }
    Gathered { seeds: kept, estimates: found, members: lists, owners }
}

/// An owner by the new numbers; a surface that was given up owns nothing.
fn renumbered(owner: Owner, number: &[u32]) -> Owner {
    match owner {
        Owner::Nobody | Owner::Uneven | Owner::Outvoted | Owner::Either(..) => owner,
        Owner::Place(place) => match number[place as usize] {
            u32::MAX => Owner::Nobody,
            place => Owner::Place(place),
        },
    }
}

/// Which places have their points on a plane.
pub(crate) fn is_even(gathered: &Gathered, around: &[Bend], options: &FusionOptions) -> Vec<bool> {
    let deviations = Distribution::Normal.upper_quantile(options.outlier_level);
    let goes_on = largest_off();
    let is_plane =
        |(place, bend): (&Estimate, &Bend)| place.is_plane(deviations, options.voxel_m) && bend.off.abs() <= goes_on;
    gathered.estimates.iter().zip(around).map(is_plane).collect()
}

/// Gives up places but those that are kept; their points are of this owner.
pub(crate) fn give_up(gathered: &mut Gathered, around: &mut Vec<Bend>, is_kept: &[bool], instead: Owner) {
    let mut number = vec![u32::MAX; is_kept.len()];
    let mut count = 0;
    for (at, number) in number.iter_mut().enumerate().filter(|(at, _)| is_kept[*at]) {
        *number = count;
        gathered.seeds.swap(count as usize, at);
        gathered.estimates.swap(count as usize, at);
        gathered.members.swap(count as usize, at);
        around.swap(count as usize, at);
        count += 1;
    }
    gathered.seeds.truncate(count as usize);
    gathered.estimates.truncate(count as usize);
    gathered.members.truncate(count as usize);
    around.truncate(count as usize);
    for owner in &mut gathered.owners {
        *owner = match *owner {
            Owner::Place(place) if number[place as usize] == u32::MAX => instead,
            other => renumbered(other, &number),
        };
    }
}

/// Refuses a cloud in which nothing is fused, with what tells why.
pub(crate) fn nonempty(gathered: &Gathered, observations: &Observations) -> Result<()> {
    if gathered.estimates.is_empty() {
        let lattice = &observations.lattice;
        let mut keys = observations.keys.clone();
        keys.dedup();
        let all = observations.all.iter().map(|o| &o.position);
        let (low, high) = all
            .fold((Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)), |(low, high), p| {
                (low.inf(&p.coords), high.sup(&p.coords))
            });
        let points = observations.all.len();
        return Err(Error::NoSurface {
            points,
            cells: keys.len(),
            voxel_m: lattice.size_m,
            per_cell: points as f64 / keys.len() as f64,
            extent_m: (high - low).amax(),
        });
    }
    Ok(())
}
