//! Which poses of two trajectories belong together.

use nalgebra::Isometry3;

use crate::error::{Error, Result};
use rigid_pose::{InputError, is_finite, require_option};

pub(super) type Stamped = (f64, Isometry3<f64>);

/// Indices into the estimate and the truth, in the order of the estimate's times.
///
/// Each pose is used once; of several candidates the one nearer in time wins, of equally near ones the earlier.
pub(super) fn associate(estimate: &[Stamped], truth: &[Stamped], tolerance_s: f64) -> Result<Vec<(usize, usize)>> {
    check("the estimated trajectory", estimate)?;
    check("the true trajectory", truth)?;
    let is_inside = |tolerance: f64| tolerance >= 0.0 && tolerance.is_finite();
    require_option("max_time_difference_s", tolerance_s, "0 or more and finite", is_inside)?;
    let (of_estimate, of_truth) = (by_time(estimate), by_time(truth));
    let mut candidates: Vec<(f64, usize, usize)> = Vec::new();
    for (rank, &index) in of_estimate.iter().enumerate() {
        let time = estimate[index].0;
        let above = of_truth.partition_point(|&candidate| truth[candidate].0 < time);
        for neighbour in [above.checked_sub(1), Some(above)].into_iter().flatten() {
            let Some(&candidate) = of_truth.get(neighbour) else { continue };
            let difference = (truth[candidate].0 - time).abs();
            if difference <= tolerance_s {
                candidates.push((difference, rank, candidate));
            }
        }
    }
    candidates.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
    let (mut of_rank, mut taken) = (vec![None; estimate.len()], vec![false; truth.len()]);
    for (_, rank, candidate) in candidates {
        if of_rank[rank].is_none() && !taken[candidate] {
            (of_rank[rank], taken[candidate]) = (Some(candidate), true);
        }
    }
    let pairs: Vec<(usize, usize)> =
        of_estimate.iter().zip(of_rank).filter_map(|(&index, candidate)| Some((index, candidate?))).collect();
    if pairs.is_empty() {
        let span = |poses: &[Stamped], order: &[usize]| [poses[order[0]].0, poses[order[order.len() - 1]].0];
        return Err(Error::NoCommonTime {
            tolerance_s,
            estimate_s: span(estimate, &of_estimate),
            truth_s: span(truth, &of_truth),
        });
    }
    Ok(pairs)
}

fn check(what: &'static str, poses: &[Stamped]) -> Result<()> {
    if poses.is_empty() {
        return Err(InputError::Empty { what }.into());
    }
    match poses.iter().position(|(time, pose)| !(time.is_finite() && is_finite(pose))) {
        Some(index) => Err(InputError::NonFinite { what, index }.into()),
        None => Ok(()),
    }
}

fn by_time(poses: &[Stamped]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..poses.len()).collect();
    order.sort_by(|&a, &b| poses[a].0.total_cmp(&poses[b].0));
    order
}
