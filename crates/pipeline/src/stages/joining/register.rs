use multiview_registration::rigid_pose::Uncertain;
use multiview_registration::{FrameRegistration, PlacedFrame, Start, StationRegistration};
use nalgebra::Isometry3;

use crate::stages::Findings;
use crate::stages::joining::{Gathered, Joined, Registered};
use crate::stations::refused::{self, Tried};
use crate::stations::{register_as_frames, register_at_once};
use crate::survey::records::{AdjustmentFigures, StationPose};
use crate::{Error, Result};
use commands::Progress;
use commands::plan::{RegisterOptions, StartPoses};

/// All stations are brought together from what is known of their poses.
pub(crate) fn run(
    mut gathered: Gathered,
    options: &RegisterOptions,
    progress: &dyn Progress,
) -> Result<(Joined, Findings)> {
    gathered.prepare();
    if let Some(error) = gathered.failed {
        return Err(error);
    }
    if gathered.clouds.is_empty() {
        return Err(Error::Needs { stage: "Register", needs: "PointCloud" });
    }
    progress.begin("Register", gathered.clouds.len());
    // The first station is where the survey says it is.
    let stated = gathered.stated.first().copied().flatten();
    let approximate: Option<Vec<Isometry3<f64>>> = gathered.stated.iter().copied().collect();
    let joined = match options.start {
        StartPoses::Neighbour => each_onto_the_one_before(gathered, stated),
        StartPoses::Approximate => {
            let start = approximate.as_deref().map_or(Start::Order, Start::Poses);
            at_once(gathered, stated, start, options, progress)?
        }
        StartPoses::Order => at_once(gathered, stated, Start::Order, options, progress)?,
    };
    let findings = [("pairs", joined.pairs.len()), ("pairs_refused", joined.refused.len())];
    Ok((joined, findings.map(|(name, count)| (name.to_owned(), count as f64)).into()))
}

/// The frame in which the first station is where it is stated to be.
fn world(stated: Option<Isometry3<f64>>, first: Option<&Isometry3<f64>>) -> Isometry3<f64> {
    stated.zip(first).map_or_else(Isometry3::identity, |(stated, found)| stated * found.inverse())
}

fn at_once(
    Gathered { names, clouds, frames, stated: all_stated, .. }: Gathered,
    stated: Option<Isometry3<f64>>,
    start: Start<'_>,
    options: &RegisterOptions,
    progress: &dyn Progress,
) -> Result<Joined> {
    let before = if let Start::Poses(poses) = start { Some(poses) } else { None };
    let mut as_frames = (frames.len() == clouds.len()).then(|| register_as_frames(&frames, before).ok()).flatten();
    if let Some(found) = as_frames.take_if(|found| found.unplaced.is_empty()) {
        return Ok(from_frames(found, &all_stated, names));
    }
    let limits = Some((options.minimum_overlap, options.maximum_distance_m));
    let tried = match start {
        Start::Poses(_) => Tried::Poses(Some(options.maximum_distance_m)),
        Start::Order => Tried::Order,
        Start::Nothing => Tried::AllPairs,
    };
    let found = register_at_once(&clouds, start, limits, &[], progress);
    // Not all belong together, or not as clouds: those that do are brought together.
    if let Some(frames) = as_frames.filter(|_| !found.as_ref().is_ok_and(StationRegistration::fits_noise)) {
        return Ok(from_frames(frames, &all_stated, names));
    }
    let found = found.map_err(|error| refused::of_stage("Register", error, &names, tried))?;
    let world = world(stated, found.world_from_station.first());
    let (registered, pairs) = Registered::new(found, &world, options.minimum_overlap);
    let poses = without_covariances(&registered.poses);
    let registered = matches!(start, Start::Poses(_)).then_some(registered);
    Ok(Joined { poses, pairs, registered, names, clouds, ..Joined::default() })
}

/// How well poses are known is what `Adjust` says.
fn without_covariances(poses: &[Option<StationPose>]) -> Vec<Option<StationPose>> {
    let without = |pose: &StationPose| StationPose { covariance: None, ..*pose };
    poses.iter().map(|pose| pose.as_ref().map(without)).collect()
}

/// The frames that were placed, in the world in which the datum stands as stated.
fn from_frames(found: FrameRegistration, stated: &[Option<Isometry3<f64>>], names: Vec<String>) -> Joined {
    let FrameRegistration { frames, datum, unplaced: left_out, pairs, refused, unchecked, placements, .. } = found;
    let world = Uncertain::exact(world(stated[datum], frames[datum].map(|frame| frame.world_from_frame).as_ref()));
    let pose = |frame: &PlacedFrame| {
        let pose = world.then(&Uncertain { pose: frame.world_from_frame, covariance: frame.covariance });
        StationPose { world_from_camera: pose.pose, covariance: Some(pose.covariance) }
    };
    let (sigma0, placed) = (Some(found.variance_factor.sqrt()), frames.iter().flatten().count());
    let figures = AdjustmentFigures { sigma0, redundancy: 6 * (pairs.len() as i64 + 1 - placed as i64), placements };
    let (poses, surfaces) = (frames.iter().map(|frame| frame.as_ref().map(pose)).collect(), pairs.len());
    let registered = Registered { poses, minimum_overlap: None, surfaces, rounds: 1, settled: true, figures };
    let poses = without_covariances(&registered.poses);
    Joined { poses, left_out, pairs, refused, unchecked, registered: Some(registered), names, ..Joined::default() }
}

fn each_onto_the_one_before(Gathered { names, clouds, pairs, .. }: Gathered, stated: Option<Isometry3<f64>>) -> Joined {
    let mut poses = vec![Isometry3::identity()];
    for pair in &pairs {
        poses.push(poses[pair.target] * pair.result.target_from_source);
    }
    let world = world(stated, poses.first());
    let pose = |pose: &Isometry3<f64>| Some(StationPose { world_from_camera: world * pose, covariance: None });
    Joined { poses: poses.iter().map(pose).collect(), pairs, names, clouds, ..Joined::default() }
}
