use multiview_registration::Start;
use nalgebra::Isometry3;

use crate::stages::Findings;
use crate::stages::joining::{Joined, Registered};
use crate::stations::refused::{self, Tried};
use crate::stations::register_at_once;
use crate::{Error, Result};
use commands::Progress;
use commands::plan::AdjustOptions;

/// All stations are adjusted at once from their surfaces, the first one being the datum.
pub(crate) fn run(joined: &mut Joined, options: &AdjustOptions, progress: &dyn Progress) -> Result<Findings> {
    if joined.names.is_empty() {
        return Err(Error::Needs { stage: "Adjust", needs: "Register" });
    }
    let same_pairs = |known: &Registered| {
        known.minimum_overlap.is_none_or(|overlap| overlap.to_bits() == options.minimum_overlap.to_bits())
    };
    let known = joined.registered.take().filter(|known| known.settled && same_pairs(known));
    let adjusted = match known {
        Some(known) => known,
        None => again(joined, options, progress)?,
    };
    if !adjusted.settled {
        return Err(Error::stage("Adjust", "all stations")(format!(
            "the stations still slide after {} rounds: a direction is held by too little; more overlap, or stations \
             that see furniture from the side, are needed",
            adjusted.rounds
        )));
    }
    let mut findings = Findings::from([
        ("stations_doubtful".to_owned(), adjusted.figures.placements.doubtful().count() as f64),
        ("pairs".to_owned(), adjusted.surfaces as f64),
        ("rounds".to_owned(), adjusted.rounds as f64),
    ]);
    if let Some(sigma0) = adjusted.figures.sigma0 {
        findings.insert("sigma0".to_owned(), sigma0);
    }
    joined.poses = adjusted.poses;
    joined.adjustment = Some(adjusted.figures);
    Ok(findings)
}

/// From the poses that `Register` found.
fn again(joined: &mut Joined, options: &AdjustOptions, progress: &dyn Progress) -> Result<Registered> {
    let initial: Vec<Isometry3<f64>> = joined.poses.iter().flatten().map(|pose| pose.world_from_camera).collect();
    progress.begin("Adjust", joined.clouds.len());
    let limits = Some((options.minimum_overlap, options.maximum_distance_m));
    let found = register_at_once(&joined.clouds, Start::Poses(&initial), limits, &[], progress);
    let tried = Tried::Poses(Some(options.maximum_distance_m));
    let found = found.map_err(|error| refused::of_stage("Adjust", error, &joined.names, tried))?;
    let (adjusted, pairs) = Registered::new(found, &Isometry3::identity(), options.minimum_overlap);
    joined.pairs = pairs;
    Ok(adjusted)
}
