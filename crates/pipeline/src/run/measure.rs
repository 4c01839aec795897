//! Figures of a run: what each stage changed, and the summary of the whole.

use std::collections::BTreeMap;
use std::path::Path;

use multiview_registration::{Placements, RefusedPair};
use nalgebra::Isometry3;
use range_image::Flags;

use crate::command::verdict::{Doubt, DoubtKind};
use crate::plan::{Plan, ruled_out};
use crate::run::results::own_clouds;
use crate::run::summary::{PairSummary, ReferenceSummary, RegistrationSummary, StationTruth, Summary, TruthSummary};
use crate::stages::wraps::repair;
use crate::stations::placement::wrong_place;
use crate::survey::load::first_modulation;
use crate::survey::outcome::{Outcome, usable};
use crate::survey::plausibility;
use crate::survey::truth::{RangeTruth, evaluate, wrap};
use crate::survey::view::{Snapshot, View, ViewData};
use crate::trends;
use statistics::{quantile, robust_standard_deviation};

/// Median absolute change of the ranges between two moments, metre, modulo the ambiguity interval.
///
/// `None` where the number of views changed, or ranges were not there yet.
pub(crate) fn median_change(before: &[Option<Snapshot>], views: &[View]) -> Option<f64> {
    if before.len() != views.len() {
        return None;
    }
    let mut changes = Vec::new();
    for (before, view) in before.iter().zip(views) {
        let (before, after) = (before.as_ref()?, view.snapshot()?);
        for (before, after) in before.range.as_slice().iter().zip(after.range.as_slice()) {
            let change = f64::from(*after) - f64::from(*before);
            changes.push(view.modulation.map_or(change, |modulation| wrap(change, modulation)).abs());
        }
    }
    Some(quantile(&mut changes, 0.5)).filter(|change| change.is_finite())
}

/// Range errors of all views together.
pub(crate) fn evaluate_all(views: &[View]) -> Option<RangeTruth> {
    let all: Vec<&View> = views.iter().collect();
    evaluate(&all, views.first().and_then(|view| view.modulation))
}

/// Every figure of the run but its time and output folder.
pub(crate) fn summarise(plan: &Plan, survey: &Path, outcome: &Outcome) -> Summary {
    let format = outcome.camera.format;
    let mut stations: Vec<&str> = outcome.views.iter().map(|view| view.station.as_str()).collect();
    stations.sort_unstable();
    stations.dedup();
    Summary {
        pipeline: plan.name.clone(),
        survey: survey.display().to_string(),
        calibration: outcome.calibration.clone(),
        level: outcome.survey.level.name(),
        size_px: [format.width, format.height],
        frames: outcome.survey.frames.len(),
        stations: stations.len(),
        stages: outcome.stages.clone(),
        drifts: outcome.views.iter().filter_map(|view| view.correction.as_ref()?.drift().cloned()).collect(),
        ruled_out: ruled_out(outcome.survey.level),
        flags_fraction: flag_fractions(&outcome.views),
        points: outcome.clouds.iter().map(|cloud| usable(cloud).count()).sum(),
        sigma_range_median_m: median_sigma(&outcome.views),
        registration: registration(outcome),
        reference: reference(&outcome.views),
        truth: truth(outcome),
        remaining: trends::remaining(outcome),
        refusal: outcome.refusal.clone(),
        own_clouds: own_clouds(outcome),
        doubts: doubts(outcome),
        seconds: 0.0,
        out: String::new(),
    }
}

fn flag_fractions(views: &[View]) -> BTreeMap<String, f64> {
    let all: Vec<Flags> =
        views.iter().filter_map(View::flags).flat_map(|flags| flags.as_slice().iter().copied()).collect();
    let fraction = |count: usize| count as f64 / all.len().max(1) as f64;
    let mut fractions: BTreeMap<String, f64> = Flags::NAMED
        .iter()
        .map(|(flag, name)| ((*name).to_owned(), fraction(all.iter().filter(|flags| flags.contains(*flag)).count())))
        .filter(|(_, fraction)| *fraction > 0.0)
        .collect();
    fractions.insert("any".to_owned(), fraction(all.iter().filter(|flags| !flags.is_empty()).count()));
    fractions
}

fn median_sigma(views: &[View]) -> Option<f64> {
    let mut sigmas = Vec::new();
    for view in views {
        if let ViewData::Range(frame) = &view.data {
            let pairs = frame.sigma.as_slice().iter().zip(frame.flags.as_slice());
            sigmas.extend(pairs.filter(|(_, flags)| flags.is_empty()).map(|(sigma, _)| f64::from(*sigma)));
        }
    }
    Some(quantile(&mut sigmas, 0.5)).filter(|sigma| sigma.is_finite())
}

fn registration(outcome: &Outcome) -> Option<RegistrationSummary> {
    if outcome.pairs.is_empty() {
        return None;
    }
    let distance = |a: &Isometry3<f64>, b: &Isometry3<f64>| (a.translation.vector - b.translation.vector).norm();
    let pairs = outcome.pairs.iter().map(|pair| PairSummary {
        target: outcome.views[pair.target].station.clone(),
        source: outcome.views[pair.source].station.clone(),
        overlap: pair.result.overlap,
        rms_m: pair.result.rms_m,
        iterations: pair.result.iterations,
        distance_m: distance(
            &outcome.poses[pair.target].world_from_camera,
            &outcome.poses[pair.source].world_from_camera,
        ),
    });
    // Poses of stations that were not brought together after all are nobody's.
    let sigmas = outcome
        .poses
        .iter()
        .filter(|_| outcome.refusal.is_none())
        .filter_map(crate::survey::outcome::StationPose::position_sigma_m);
    Some(RegistrationSummary {
        pairs: pairs.collect(),
        refused: outcome.refused.iter().map(|pair| refusal(outcome, pair)).collect(),
        sigma0: outcome.adjustment.as_ref().and_then(|figures| figures.sigma0),
        redundancy: outcome.adjustment.as_ref().map(|figures| figures.redundancy),
        position_sigma_max_m: sigmas.reduce(f64::max),
    })
}

/// What speaks against survey and result.
fn doubts(outcome: &Outcome) -> Vec<Doubt> {
    let mut doubts: Vec<Doubt> = outcome
        .refusal
        .iter()
        .map(|refusal| {
            let words =
                format!("{}; each cloud is in the frame of its own camera, and no poses are written", refusal.reason);
            Doubt::about(DoubtKind::Refused, refusal.stage, words)
        })
        .collect();
    doubts.extend(outcome.doubts.iter().cloned());
    doubts.extend(repair::unjudged(&outcome.stages));
    doubts.extend(plausibility::of_outcome(outcome));
    if outcome.refusal.is_none() {
        doubts.extend(outcome.adjustment.iter().flat_map(|figures| wrong_places(outcome, &figures.placements)));
    }
    doubts
}

/// What to say of stations that are probably in the wrong place.
fn wrong_places(outcome: &Outcome, placements: &Placements) -> Vec<Doubt> {
    let words = |station: usize| wrong_place(&outcome.views[station].station, &placements.stations[station]);
    placements.doubtful().map(words).collect()
}

fn refusal(outcome: &Outcome, pair: &RefusedPair) -> String {
    let station = |index: usize| &outcome.views[index].station;
    format!("{} to {}: {}", station(pair.source), station(pair.target), pair.reason)
}

/// Unflagged ranges against the reference, up to a constant, modulo the ambiguity interval.
fn reference(views: &[View]) -> Option<ReferenceSummary> {
    let mut differences = Vec::new();
    let mut modulation = None;
    for view in views {
        let (Some(reference), ViewData::Range(frame)) = (&view.reference_range, &view.data) else { continue };
        modulation = view.modulation;
        for ((range, reference), flags) in
            frame.range.as_slice().iter().zip(reference.as_slice()).zip(frame.flags.as_slice())
        {
            let difference = f64::from(*range) - f64::from(*reference);
            if flags.is_empty() && difference.is_finite() {
                differences.push(difference);
            }
        }
    }
    if differences.is_empty() {
        return None;
    }
    let mut constant = quantile(&mut differences.clone(), 0.5);
    if let Some(modulation) = modulation {
        // The reference may be wrapped where ours is not: differences are brought next to the common constant.
        for difference in &mut differences {
            *difference = constant + wrap(*difference - constant, modulation);
        }
        constant = quantile(&mut differences.clone(), 0.5);
    }
    Some(ReferenceSummary {
        constant_m: constant,
        robust_standard_deviation_m: robust_standard_deviation(&differences),
        pixels: differences.len(),
    })
}

fn truth(outcome: &Outcome) -> Option<TruthSummary> {
    let modulation = first_modulation(outcome);
    let ranges = evaluate(&outcome.views.iter().collect::<Vec<_>>(), modulation)?;
    let mut stations = BTreeMap::new();
    for (index, view) in outcome.views.iter().enumerate() {
        let Some(ranges) = evaluate(&[view], modulation) else { continue };
        let errors = pose_errors(outcome, index);
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
fn pose_errors(outcome: &Outcome, index: usize) -> Option<[f64; 2]> {
    let estimated = outcome.poses.get(index).filter(|_| outcome.refusal.is_none())?.world_from_camera;
    let truth = outcome.views[index].truth.as_ref()?.world_from_camera?;
    let position = (estimated.translation.vector - truth.translation.vector).norm();
    Some([position, estimated.rotation.angle_to(&truth.rotation).to_degrees()])
}
