//! Frames that see a surface elsewhere than the other frames do: taken out of the mean, and kept as a surface of their own.

use point_uncertainty::{CommonErrors, PointErrors};
use rayon::prelude::*;
use statistics::{Distribution, holm};

use super::rows::{Row, difference, form, mean, rows};
use crate::Result;
use crate::input::Observations;
use crate::surfels::{Alone, Estimate, FrameSums, Gathered, Owner, estimate};

/// Heights that frames may differ by on a surface that bends and of which they see different parts, cells.
const SHAPE: f64 = 0.02;
/// Deviations without common errors below which nothing is tested: no level of a survey is as large as theirs, 1e-3.
const PLAIN: f64 = 3.3;
/// Rounds in which one frame leaves a place. What contradicts itself more often than that stays together.
const ROUNDS: usize = 8;

/// Takes frames out of places that they contradict.
pub(crate) fn split(
    gathered: &mut Gathered,
    observations: &Observations,
    errors: &dyn PointErrors,
    common: &CommonErrors,
    level: f64,
) -> Result<()> {
    let voxel_m = observations.lattice.size_m;
    let places = gathered.estimates.len().max(1);
    let of_place = level / places as f64;
    let mut asked: Vec<usize> = (0..gathered.estimates.len()).collect();
    for _ in 0..ROUNDS {
        let leaving: Vec<Option<u32>> = asked
            .par_iter()
            .with_min_len(32)
            .map(|at| leaving(&gathered.estimates[*at], observations, errors, common, of_place, voxel_m))
            .collect::<Result<_>>()?;
        let leaving: Vec<(usize, u32)> =
            asked.iter().zip(leaving).filter_map(|(at, frame)| Some((*at, frame?))).collect();
        if leaving.is_empty() {
            break;
        }
        asked = leaving.iter().map(|(at, _)| *at).collect();
        for (at, frame) in leaving {
            take_out(gathered, observations, at, frame);
        }
        asked.retain(|at| gathered.estimates[*at].frames.len() > 1);
    }
    in_order(gathered);
    Ok(())
}

/// The frame that contradicts the others most, where one does.
fn leaving(
    place: &Estimate,
    observations: &Observations,
    errors: &dyn PointErrors,
    common: &CommonErrors,
    level: f64,
    voxel_m: f64,
) -> Result<Option<u32>> {
    if place.frames.len() < 2 {
        return Ok(None);
    }
    let own: Vec<(f64, f64)> = place.frames.iter().map(|frame| apart(place, frame, voxel_m)).collect();
    // Common errors only make it more probable.
    if own.iter().all(|(height, variance)| height.abs() < PLAIN * variance.sqrt()) {
        return Ok(None);
    }
    let rows = rows(place, &place.normal, &observations.all, errors, common)?;
    let all = mean(place, &rows);
    let p_values: Vec<f64> = place
        .frames
        .iter()
        .zip(&rows)
        .zip(own)
        .map(|((frame, row), (height, variance))| {
            // Of the frame against the rest, as the height is.
            let by: Row = difference(row, &all, 1.0 / (1.0 - frame.normal[(0, 0)] / place.weight));
            Distribution::Normal.p_value(height / (variance + form(&by, &by, common.covariance())).sqrt())
        })
        .collect();
    let rank = |at: &usize| (p_values[*at], place.frames[*at].normal[(0, 0)]);
    let two = place.frames.len() == 2;
    let worst = (0..p_values.len()).min_by(|a, b| {
        let (a, b) = (rank(a), rank(b));
        // Of two frames, neither is more probable than the other: the one that is known less leaves.
        if two { a.1.total_cmp(&b.1) } else { a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)) }
    });
    let adjusted = holm(&p_values);
    Ok(worst.filter(|at| adjusted[*at] < level).map(|at| place.frames[at].frame))
}

/// Height of a frame over what all others see, and its variance without common errors.
fn apart(place: &Estimate, frame: &FrameSums, voxel_m: f64) -> (f64, f64) {
    let weight = frame.normal[(0, 0)];
    let rest = place.weight - weight;
    let residual = (frame.right[0] - frame.normal.row(0).transpose().dot(&place.solution)) / weight;
    let centre = |row: nalgebra::Vector3<f64>| nalgebra::Vector2::new(row[1], row[2]) / row[0];
    let of_frame = frame.normal.row(0).transpose();
    let of_all: nalgebra::Vector3<f64> = place.frames.iter().map(|f| f.normal.row(0).transpose()).sum();
    let aside = (centre(of_frame) - centre(of_all - of_frame)).norm_squared();
    let shape = SHAPE * voxel_m;
    let variance = 1.0 / weight + 1.0 / rest + place.tilt_variance * aside + shape * shape;
    (residual * place.weight / rest, variance)
}

/// Makes the points of a frame a place of their own, or nobody's where they are too few.
fn take_out(gathered: &mut Gathered, observations: &Observations, at: usize, frame: u32) {
    let all = &observations.all;
    let (own, rest): (Vec<u32>, Vec<u32>) =
        gathered.members[at].iter().partition(|point| all[**point as usize].frame == frame);
    let (key, seed) = gathered.seeds[at];
    let Some(left) = estimate(&seed, &rest, all, &Alone) else { return };
    gathered.estimates[at] = left;
    gathered.members[at] = rest;
    let owner = match estimate(&seed, &own, all, &Alone) {
        Some(apart) => {
            gathered.seeds.push((key, crate::patches::Seed { frame, ..seed }));
            gathered.estimates.push(apart);
            Owner::Place(gathered.members.len() as u32)
        }
        None => Owner::Nobody,
    };
    for point in &own {
        gathered.owners[*point as usize] = owner;
    }
    if owner != Owner::Nobody {
        gathered.members.push(own);
    }
}

/// Places in the order of their cells again.
fn in_order(gathered: &mut Gathered) {
    let mut order: Vec<u32> = (0..gathered.seeds.len() as u32).collect();
    order.sort_by_key(|at| (gathered.seeds[*at as usize].0, *at));
    let mut number = vec![0; order.len()];
    for (new, old) in order.iter().enumerate() {
        number[*old as usize] = new as u32;
    }
    gathered.seeds = order.iter().map(|at| gathered.seeds[*at as usize]).collect();
    gathered.estimates = order.iter().map(|at| gathered.estimates[*at as usize].clone()).collect();
    gathered.members = order.iter().map(|at| std::mem::take(&mut gathered.members[*at as usize])).collect();
    for owner in &mut gathered.owners {
        *owner = match *owner {
            Owner::Place(at) => Owner::Place(number[at as usize]),
            other => other,
        };
    }
}
