use icp_registration::{
    Cloud, IcpTarget, OrganisedNormalOptions, PairAlignment, RefusedPair, SurfaceAdjustmentOptions, align_pairs,
    find_overlaps, organised_normals,
};
use nalgebra::Isometry3;

use super::Findings;
use crate::outcome::StationPose;
use crate::plan::RegisterOptions;
use crate::progress::Progress;
use crate::work::Work;
use crate::{Error, Result};

/// Overlapping stations are aligned pair by pair, and the best pairs carry the poses from the first station on.
pub(super) fn run(work: &mut Work, options: &RegisterOptions, progress: &dyn Progress) -> Result<Findings> {
    let targets = station_clouds(work, options)?;
    let approximate = approximate_poses(work);
    let candidates = candidate_pairs(&targets, &approximate, options)?;
    progress.begin("Register", candidates.len());
    let icp = SurfaceAdjustmentOptions::with_initial_error(options.maximum_distance_m).icp;
    let (pairs, refused) = align_pairs(&targets, &approximate, &candidates, &icp, &|done, _| progress.advance(done));
    let poses = spanning_poses(work, &pairs, &refused, &approximate)?;
    work.outcome.poses = poses;
    let findings = [("pairs", pairs.len()), ("pairs_refused", refused.len())];
    work.outcome.pairs = pairs;
    work.outcome.refused = refused;
    work.station_clouds = targets;
    Ok(findings.map(|(name, count)| (name.to_owned(), count as f64)).into())
}

/// The unflagged points of each view with normals from its grid, as targets with their trees.
fn station_clouds(work: &Work, options: &RegisterOptions) -> Result<Vec<IcpTarget>> {
    let clouds = work.outcome.clouds.iter().zip(&work.outcome.views);
    if work.outcome.clouds.is_empty() {
        return Err(Error::Needs { stage: "Register", needs: "PointCloud" });
    }
    let normal_options =
        OrganisedNormalOptions { half_width_px: options.normal_half_width_px, ..OrganisedNormalOptions::default() };
    let prepared = clouds.map(|(cloud, view)| {
        let name = view.name();
        let fail = || Error::stage::<icp_registration::Error>("Register", &name);
        let mut points = cloud.points.clone();
        for (point, flags) in points.iter_mut().zip(&cloud.flags) {
            if !flags.is_empty() {
                *point = [f64::NAN; 3];
            }
        }
        let normals = organised_normals(&points, cloud.width, cloud.height, &normal_options);
        let normals = normals.map_err(fail())?;
        let cloud = Cloud::from_frame(&points, Some(&normals), Some(&cloud.sigma)).map_err(fail())?;
        IcpTarget::new(cloud).map_err(fail())
    });
    prepared.collect()
}

fn approximate_poses(work: &Work) -> Vec<Isometry3<f64>> {
    work.outcome.views.iter().map(|view| view.approximate_world_from_camera.unwrap_or_default()).collect()
}

/// Pairs that the approximate poses say overlap; neighbours in time where nothing is known of the poses.
fn candidate_pairs(
    targets: &[IcpTarget],
    approximate: &[Isometry3<f64>],
    options: &RegisterOptions,
) -> Result<Vec<(usize, usize)>> {
    if approximate.iter().all(|pose| *pose == Isometry3::identity()) {
        return Ok((1..targets.len()).map(|source| (source - 1, source)).collect());
    }
    let overlaps = find_overlaps(targets, approximate, options.maximum_distance_m);
    let overlaps = overlaps.map_err(Error::stage("Register", "overlaps"))?;
    let enough = overlaps.into_iter().filter(|overlap| overlap.fraction >= options.minimum_overlap);
    Ok(enough.map(|overlap| (overlap.target, overlap.source)).collect())
}

/// Poses along the tree of pairs with the most overlap, from the first station on.
fn spanning_poses(
    work: &Work,
    pairs: &[PairAlignment],
    refused: &[RefusedPair],
    approximate: &[Isometry3<f64>],
) -> Result<Vec<StationPose>> {
    let mut poses: Vec<Option<StationPose>> = vec![None; approximate.len()];
    if let (Some(first), Some(pose)) = (poses.first_mut(), approximate.first()) {
        *first = Some(StationPose { world_from_camera: *pose, covariance: None });
    }
    let mut order: Vec<&PairAlignment> = pairs.iter().collect();
    // Pairs that determine all six unknowns first, then those with the most overlap.
    order.sort_by(|a, b| {
        let sound = |pair: &PairAlignment| pair.result.degenerate.is_empty();
        sound(b).cmp(&sound(a)).then(b.result.overlap.total_cmp(&a.result.overlap))
    });
    // Each round adds the best pair that leads from a known station to an unknown one.
    while let Some(pair) = order.iter().find(|pair| poses[pair.target].is_some() != poses[pair.source].is_some()) {
        let target_from_source = pair.result.target_from_source;
        if let Some(known) = &poses[pair.target] {
            let world_from_camera = known.world_from_camera * target_from_source;
            poses[pair.source] = Some(StationPose { world_from_camera, covariance: None });
        } else if let Some(known) = &poses[pair.source] {
            let world_from_camera = known.world_from_camera * target_from_source.inverse();
            poses[pair.target] = Some(StationPose { world_from_camera, covariance: None });
        }
    }
    let lost: Vec<String> = poses
        .iter()
        .zip(&work.outcome.views)
        .filter(|(pose, _)| pose.is_none())
        .map(|(_, v)| v.station.clone())
        .collect();
    if lost.is_empty() {
        return Ok(poses.into_iter().flatten().collect());
    }
    let station = |index: usize| work.outcome.views[index].station.as_str();
    let reasons =
        refused.iter().map(|pair| format!("{} to {}: {}", station(pair.source), station(pair.target), pair.reason));
    let reasons: Vec<String> = reasons.collect();
    Err(Error::stage("Register", &format!("stations {}", lost.join(", ")))(format!(
        "no reliable alignment connects them to the first station; more overlap or better approximate poses are needed \
         ({})",
        reasons.join("; ")
    )))
}
