//! Figures of a run, gathered into its summary.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use multiview_registration::{Placements, RefusedPair};
use nalgebra::Isometry3;

use crate::run::files::clouds::OwnCloud;
use crate::run::flow::Flow;
use crate::run::kept::Kept;
use crate::run::summary::{PairSummary, RegistrationSummary, StationTruth, Summary, TruthSummary};
use crate::stages::joining::Joined;
use crate::stages::wraps::repair;
use crate::stations::placement::{not_placed, unchecked, wrong_place};
use crate::survey::plausibility;
use crate::survey::records::{RefusedStage, StationPose, ViewRecord};
use commands::plan::{Plan, ruled_out};
use commands::{Doubt, DoubtKind};
use statistics::quantile;

/// Every figure of the run but its time and output folder.
pub(crate) fn summarise(
    plan: &Plan,
    folder: &Path,
    flow: &Flow,
    kept: &mut Kept,
    refusal: Option<RefusedStage>,
    own_clouds: Vec<OwnCloud>,
) -> Summary {
    let (survey, format, joined) = (&flow.survey.survey, flow.camera().format, &flow.joined);
    // Poses of stations that were not brought together after all are nobody's.
    let found: Vec<StationPose> = joined.poses.iter().flatten().cloned().collect();
    let poses: &[StationPose] = if refusal.is_some() { &[] } else { &found };
    let stations: BTreeSet<&str> = kept.views.iter().map(|view| view.station.as_str()).collect();
    let sigma_m = quantile(&mut kept.values.sigma_m.clone(), 0.5);
    Summary {
        pipeline: plan.name.clone(),
        survey: folder.display().to_string(),
        calibration: flow.survey.calibration_words.clone(),
        level: survey.level.name(),
        size_px: [format.width, format.height],
        frames: survey.frames.len(),
        stations: stations.len(),
        stages: flow.stages.clone(),
        drifts: kept.views.iter().filter_map(|view| view.drift.clone()).collect(),
        ruled_out: ruled_out(survey.level),
        flags_fraction: kept.flag_fractions(),
        points: kept.views.iter().filter_map(|view| view.points).sum(),
        sigma_range_median_m: Some(sigma_m).filter(|sigma_m| sigma_m.is_finite()),
        registration: registration(joined, poses),
        reference: kept.reference(),
        truth: truth(kept, poses),
        remaining: kept.residuals.remaining(),
        doubts: doubts(flow, &kept.views, refusal.as_ref(), poses),
        refusal,
        own_clouds,
        tiles: None,
        seconds: 0.0,
        out: String::new(),
    }
}

fn registration(joined: &Joined, known: &[StationPose]) -> Option<RegistrationSummary> {
    if joined.pairs.is_empty() {
        return None;
    }
    let distance = |from: usize, to: usize| {
        let place = |index: usize| Some(joined.poses[index].as_ref()?.world_from_camera.translation.vector);
        place(from).zip(place(to)).map_or(f64::NAN, |(from, to)| (to - from).norm())
    };
    let pairs = joined.pairs.iter().map(|pair| PairSummary {
        target: joined.names[pair.target].clone(),
        source: joined.names[pair.source].clone(),
        overlap: pair.result.overlap,
        rms_m: pair.result.rms_m,
        iterations: pair.result.iterations,
        distance_m: distance(pair.target, pair.source),
    });
    Some(RegistrationSummary {
        pairs: pairs.collect(),
        refused: joined.refused.iter().map(|pair| refusal(&joined.names, pair)).collect(),
        sigma0: joined.adjustment.as_ref().and_then(|figures| figures.sigma0),
        redundancy: joined.adjustment.as_ref().map(|figures| figures.redundancy),
        position_sigma_max_m: known.iter().filter_map(StationPose::position_sigma_m).reduce(f64::max),
    })
}

/// What speaks against survey and result.
fn doubts(flow: &Flow, views: &[ViewRecord], refusal: Option<&RefusedStage>, poses: &[StationPose]) -> Vec<Doubt> {
    let of_refusal = |refusal: &RefusedStage| {
        let words =
            format!("{}; each cloud is in the frame of its own camera, and no poses are written", refusal.reason);
        Doubt::about(DoubtKind::Refused, refusal.stage, words)
    };
    let mut doubts: Vec<Doubt> = refusal.map(of_refusal).into_iter().collect();
    doubts.extend(flow.doubts.iter().cloned());
    doubts.extend(repair::unjudged(&flow.stages));
    doubts.extend(plausibility::of_views(views, poses));
    if refusal.is_none() {
        let Joined { names, adjustment, unchecked: pairs, left_out, .. } = &flow.joined;
        doubts.extend(left_out.iter().map(|out| not_placed(&names[out.frame], &out.reason)));
        doubts.extend(adjustment.iter().flat_map(|figures| wrong_places(names, &figures.placements)));
        doubts.extend(pairs.iter().map(|pair| unchecked(pair, |index| names[index].clone())));
    }
    doubts
}

/// What to say of stations that are probably in the wrong place.
fn wrong_places(names: &[String], placements: &Placements) -> Vec<Doubt> {
    let words = |station: usize| wrong_place(&names[station], &placements.stations[station]);
    placements.doubtful().map(words).collect()
}

fn refusal(names: &[String], pair: &RefusedPair) -> String {
    format!("{} to {}: {}", names[pair.source], names[pair.target], pair.reason)
}

fn truth(kept: &mut Kept, poses: &[StationPose]) -> Option<TruthSummary> {
    let ranges = std::mem::take(&mut kept.truth).figures()?;
    let mut stations = BTreeMap::new();
    for (index, view) in kept.views.iter().enumerate() {
        let Some(ranges) = view.truth.clone() else { continue };
        let found = poses.get(index).map(|pose| pose.world_from_camera);
        let errors = found.zip(view.true_pose).map(|(found, truth)| pose_errors(&found, &truth));
        let (position_error_m, attitude_error_deg) = (errors.map(|e| e[0]), errors.map(|e| e[1]));
        stations.insert(view.station.clone(), StationTruth { ranges, position_error_m, attitude_error_deg });
    }
    let largest = |pick: fn(&StationTruth) -> Option<f64>| stations.values().filter_map(pick).reduce(f64::max);
    Some(TruthSummary {
        position_error_max_m: largest(|station| station.position_error_m),
        attitude_error_max_deg: largest(|station| station.attitude_error_deg),
        ranges,
        stations,
    })
}

/// Errors of a station's position in metre and attitude in degree.
fn pose_errors(found: &Isometry3<f64>, truth: &Isometry3<f64>) -> [f64; 2] {
    let position = (found.translation.vector - truth.translation.vector).norm();
    [position, found.rotation.angle_to(&truth.rotation).to_degrees()]
}
