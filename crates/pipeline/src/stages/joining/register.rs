use multiview_registration::{Datum, Start, StationRegistrationOptions, register_stations};
use nalgebra::Isometry3;

use crate::stages::Findings;
use crate::stages::joining::{Gathered, Joined};
use crate::stations::refused::{self, Tried};
use crate::survey::records::StationPose;
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
    let (poses, mut joined) = match options.start {
        StartPoses::Neighbour => each_onto_the_one_before(gathered),
        StartPoses::Approximate => {
            at_once(gathered, approximate.as_deref().map_or(Start::Order, Start::Poses), options, progress)?
        }
        StartPoses::Order => at_once(gathered, Start::Order, options, progress)?,
    };
    let world = stated.zip(poses.first()).map_or_else(Isometry3::identity, |(stated, found)| stated * found.inverse());
    let pose = |pose: &Isometry3<f64>| StationPose { world_from_camera: world * pose, covariance: None };
    joined.poses = poses.iter().map(pose).collect();
    let findings = [("pairs", joined.pairs.len()), ("pairs_refused", joined.refused.len())];
    Ok((joined, findings.map(|(name, count)| (name.to_owned(), count as f64)).into()))
}

fn at_once(
    Gathered { names, clouds, .. }: Gathered,
    start: Start<'_>,
    options: &RegisterOptions,
    progress: &dyn Progress,
) -> Result<(Vec<Isometry3<f64>>, Joined)> {
    let choice = StationRegistrationOptions {
        minimum_overlap: options.minimum_overlap,
        start_error_m: Some(options.maximum_distance_m),
        ..StationRegistrationOptions::default()
    };
    let told = |done: usize, _: usize| progress.advance(done);
    let found = register_stations(&clouds, start, Datum::Station(0), &choice, &told);
    let tried = match start {
        Start::Poses(_) => Tried::Poses(Some(options.maximum_distance_m)),
        Start::Order => Tried::Order,
        Start::Nothing => Tried::AllPairs,
    };
    let found = found.map_err(|error| refused::of_stage("Register", error, &names, tried))?;
    let joined = Joined { pairs: found.pairs, refused: found.refused, names, clouds, ..Joined::default() };
    Ok((found.world_from_station, joined))
}

fn each_onto_the_one_before(Gathered { names, clouds, pairs, .. }: Gathered) -> (Vec<Isometry3<f64>>, Joined) {
    let mut poses = vec![Isometry3::identity()];
    for pair in &pairs {
        poses.push(poses[pair.target] * pair.result.target_from_source);
    }
    (poses, Joined { pairs, names, clouds, ..Joined::default() })
}
