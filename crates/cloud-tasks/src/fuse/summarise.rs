//! Figures of a fused cloud, and what speaks against it.

use std::collections::BTreeMap;
use std::ops::Range;

use commands::{Doubt, DoubtKind};
use fusion::{CommonErrorUse, Contradiction, Fused, FusionOptions, Reason, Surfel};
use nalgebra::Point3;
use point_uncertainty::Source;
use statistics::quantile;

use super::input::Usable;
use super::summary::{
    ApartSummary, ContradictionSummary, Correction, CountedPoints, FuseSummary, SharedErrorSummary, SigmaSummary,
};
use super::thickness::thickness;
use crate::request::FuseRequest;
use crate::result::ResultCloud;

/// Share of the fused points that may be contradicted without a doubt: who walks through a room during a survey hides about so
/// much of it. With a smaller one every moved chair is a doubt; with a larger one a wall seen twice is none.
const MANY_CONTRADICTIONS: f64 = 0.01;
/// Frames of one station beyond which they should be averaged pixel by pixel before they are fused: of points of single frames beside an
/// edge it does not show which ones another surface has mixed with, so that what these err by stays in the mean. With 16 frames, squared
/// errors of fused points beside edges are 1.2 of the stated variances, with 64 frames 3.7, with 170 frames 15; averaged first 1.4.
const MOST_UNAVERAGED: usize = 16;

/// What is known before anything is fused.
pub(crate) fn begin(asked: &FuseRequest, cloud: &ResultCloud, options: &FusionOptions, ending: &str) -> FuseSummary {
    let all = cloud.points.len();
    FuseSummary {
        result: asked.result.display().to_string(),
        calibration: cloud.calibration.clone(),
        voxel_m: options.voxel_m,
        common_errors: cloud.common.errors().len(),
        common_error_use: match options.common_errors {
            CommonErrorUse::Estimate => "estimated",
            CommonErrorUse::AsStated => "as_stated",
        },
        points: CountedPoints { all, flagged: all - cloud.usable.len(), ..CountedPoints::default() },
        out: asked.out.clone(),
        clouds: [format!("cloud.{ending}"), format!("unfused.{ending}")],
        ..FuseSummary::default()
    }
}

/// What was found.
pub(crate) fn finish(
    summary: &mut FuseSummary,
    usable: &Usable<'_>,
    moved: &[Point3<f64>],
    fused: &Fused,
    options: &FusionOptions,
) {
    let views = &usable.cloud.views;
    summary.points.fused = fused.surfel_of_point.iter().flatten().count();
    summary.fused_points = fused.surfels.len();
    for unfused in &fused.unfused {
        *summary.unfused.entry(reason_name(&unfused.reason)).or_default() += 1;
    }
    summary.contradictions = contradictions(&fused.contradictions, views);
    summary.contradicted_points = fused.seen_through + fused.outvoted;
    summary.outvoted_points = fused.outvoted;
    let names = |frames: &[u32]| frames.iter().map(|frame| view(views, *frame)).collect();
    let apart = fused.apart.iter().map(|apart| ApartSummary {
        frames: names(&apart.frames),
        others: names(&apart.others),
        p_value: apart.p_value,
        shifts: apart.shifts.clone(),
    });
    summary.apart = apart.collect();
    summary.sigma = sigma(&fused.surfels);
    summary.thickness = thickness(usable, moved, fused);
    let nodes = options.shared_error.map_or(0..0, |grid| grid.columns());
    summary.shared_error = shared_error(fused, &nodes);
    summary.noise_factor = fused.noise_factor;
    summary.noise_within_frames = fused.noise_within_frames;
    summary.corrections = corrections(usable.cloud, fused, &nodes);
    findings(summary, fused, !nodes.is_empty());
    summary.doubts.extend(unaveraged(&usable.cloud.station_names, &usable.frames));
    doubts(summary);
}

/// A reason as `summary.json` has it.
fn reason_name(reason: &Reason) -> &'static str {
    match reason {
        Reason::SeenThrough { .. } => "seen_through",
        Reason::Behind { .. } => "behind",
        Reason::OffSurface { .. } => "off_surface",
        Reason::Outvoted => "outvoted",
        Reason::Between { .. } => "between",
        Reason::AtEdge => "at_edge",
        Reason::Uneven => "uneven",
        Reason::Alone => "alone",
        _ => "other",
    }
}

fn view(views: &[String], frame: u32) -> String {
    views.get(frame as usize).cloned().unwrap_or_else(|| frame.to_string())
}

fn contradictions(all: &[Contradiction], views: &[String]) -> Vec<ContradictionSummary> {
    let mut by_pair: BTreeMap<(u32, u32), Vec<&Contradiction>> = BTreeMap::new();
    for found in all {
        by_pair.entry((found.front_frame, found.seen_through_by)).or_default().push(found);
    }
    let row = |((front, through), found): ((u32, u32), Vec<&Contradiction>)| ContradictionSummary {
        front: view(views, front),
        seen_through_by: view(views, through),
        pairs: found.len(),
        median_distance_m: quantile(&mut found.iter().map(|f| f.distance_m.abs()).collect::<Vec<f64>>(), 0.5),
        largest_deviations: found.iter().map(|f| f.deviations.abs()).fold(0.0, f64::max),
    };
    by_pair.into_iter().map(row).collect()
}

/// Name of what a bent surface adds to a variance, among the sources.
pub(crate) const SHAPE: &str = "shape";
/// Name of what frames disagree by beyond what the sources state.
pub(crate) const DISAGREEMENT: &str = "disagreement";

/// The parts of a fused point's variance: by source, and what disagreement and its shape add.
pub(crate) fn parts(surfel: &Surfel) -> Vec<(&'static str, f64)> {
    let sources = Source::ALL.into_iter().map(|source| (source.name(), surfel.shares.of(source)));
    sources.chain([(DISAGREEMENT, surfel.disagreement_variance()), (SHAPE, surfel.shape_variance)]).collect()
}

/// Means of the parts in shares of their variances.
pub(crate) fn mean_shares<'a>(surfels: impl Iterator<Item = &'a Surfel>) -> BTreeMap<&'static str, f64> {
    let mut shares: BTreeMap<&'static str, f64> = BTreeMap::new();
    let mut count = 0.0;
    for surfel in surfels {
        let variance = surfel.sigma_m().powi(2);
        if variance > 0.0 {
            count += 1.0;
            for (name, part) in parts(surfel) {
                *shares.entry(name).or_default() += part / variance;
            }
        }
    }
    for share in shares.values_mut() {
        *share /= count;
    }
    shares
}

fn sigma(surfels: &[Surfel]) -> Option<SigmaSummary> {
    let mut all: Vec<f64> = surfels.iter().map(Surfel::sigma_m).collect();
    (!all.is_empty()).then(|| SigmaSummary {
        median_m: quantile(&mut all, 0.5),
        below_95_m: quantile(&mut all, 0.95),
        shares: mean_shares(surfels.iter()),
    })
}

/// What was found of the error that all frames share; its nodes are these common errors.
fn shared_error(fused: &Fused, nodes: &Range<usize>) -> Option<SharedErrorSummary> {
    let found = fused.shared_error?;
    let rms = |square: &dyn Fn(usize) -> f64| (nodes.clone().map(square).sum::<f64>() / nodes.len() as f64).sqrt();
    Some(SharedErrorSummary {
        sigma_at_1_m: found.sigma_per_m,
        length_px: found.length_px,
        evidence: found.evidence,
        taken_off_rms_m: rms(&|at| fused.corrections[at].powi(2)),
        sigma_after_rms_m: rms(&|at| fused.common.covariance()[(at, at)].max(0.0)),
    })
}

fn corrections(cloud: &ResultCloud, fused: &Fused, nodes: &Range<usize>) -> Vec<Correction> {
    let sigma = |of: &point_uncertainty::CommonErrors, at: usize| of.covariance()[(at, at)].max(0.0).sqrt();
    let row = |(at, value): (usize, &f64)| {
        let error = &cloud.common.errors()[at];
        Correction {
            name: error.name.clone(),
            source: error.source.name(),
            value: *value,
            sigma_before: sigma(&cloud.common, at),
            sigma_after: sigma(&fused.common, at),
        }
    };
    fused.corrections.iter().enumerate().filter(|(at, _)| !nodes.contains(at)).map(row).collect()
}

fn findings(summary: &mut FuseSummary, fused: &Fused, is_depth_camera: bool) {
    let is_estimated = fused.corrections.iter().any(|value| *value != 0.0);
    summary.findings.push(match (summary.common_error_use, is_estimated) {
        ("as_stated", _) => {
            "Common errors are as stated: where poses err, walls stand where the weighted mean of the frames is."
                .to_owned()
        }
        (_, true) => {
            "What surfaces seen by several frames tell of the common errors was taken off the points.".to_owned()
        }
        (_, false) => "Nothing was found of the common errors, which stay as stated.".to_owned(),
    });
    if let Some(shared) = &summary.shared_error {
        summary.findings.push(format!(
            "All frames share an error of the sensor: {:.1} mm at one metre in the root mean square, growing with the squared depth and alike \
             over some {:.0} pixels. Surfaces that frames see in different pixels showed it; it was taken off.",
            1e3 * shared.taken_off_rms_m,
            shared.length_px
        ));
    } else if is_depth_camera {
        summary.findings.push("No error that all frames of the sensor share shows on the surfaces.".to_owned());
    }
    let single = fused.surfels.iter().filter(|surfel| surfel.frames.len() == 1).count();
    if single > 0 {
        let share = 100.0 * single as f64 / fused.surfels.len() as f64;
        summary.findings.push(format!(
            "{share:.0} % of the fused points were seen by one frame only: nothing could contradict them."
        ));
    }
    if fused.outvoted > 0 {
        summary.findings.push(format!(
            "{} fused points were given up, since twice as many frames spoke against them as for them; their points are among those \
             that are in none.",
            fused.outvoted
        ));
    }
    if fused.noise_factor > 1.0 {
        summary.findings.push(format!(
            "The noise of points is {:.1} times what is stated of it, as they scatter within frames and frames differ on most surfaces: it counts \
             as such.",
            fused.noise_factor.sqrt()
        ));
    }
    if fused.noise_is_overstated() {
        summary.findings.push(format!(
            "Within frames, points scatter by {:.1} times what is stated of their noise: it is stated too large, and standard deviations with it, \
             unless the camera smooths its images.",
            fused.noise_within_frames.sqrt()
        ));
    }
    summary.findings.extend(disagreement(fused));
}

/// Where frames disagree by more than what is stated of them, at more than one of a hundred fused points.
fn disagreement(fused: &Fused) -> Option<String> {
    let factors = fused.surfels.iter().map(|surfel| surfel.variance_factor).filter(|factor| *factor > 1.0);
    let mut larger: Vec<f64> = factors.map(f64::sqrt).collect();
    let share = 100.0 * larger.len() as f64 / fused.surfels.len() as f64;
    (share >= 1.0).then(|| {
        let factor = quantile(&mut larger, 0.5);
        format!(
            "At {share:.0} % of the fused points frames disagree beyond what is stated of their errors: the standard deviations there are \
             larger, {factor:.1} times in the median."
        )
    })
}

/// More frames of one station than fused points beside edges are right with.
fn unaveraged(station_names: &[String], frame_of_point: &[u32]) -> Option<Doubt> {
    let mut is_used = vec![false; station_names.len()];
    for frame in frame_of_point {
        is_used[*frame as usize] = true;
    }
    let mut of_station: BTreeMap<&str, usize> = BTreeMap::new();
    for (name, _) in station_names.iter().zip(is_used).filter(|(_, is_used)| *is_used) {
        *of_station.entry(name).or_default() += 1;
    }
    let (station, most) = of_station.iter().max_by_key(|(_, count)| **count)?;
    (*most > MOST_UNAVERAGED).then(|| {
        let stations = of_station.values().filter(|count| **count > MOST_UNAVERAGED).count();
        let words = format!(
            "{most} frames of this station were fused without being averaged (stations with more than {MOST_UNAVERAGED}: {stations}): what \
             edges do to points is not averaged with their noise, so that fused points beside edges err by more than is stated; put \
             Average() into the pipeline, before the ranges are made points"
        );
        Doubt::about(DoubtKind::Noise, *station, words)
    })
}

fn doubts(summary: &mut FuseSummary) {
    for apart in &summary.apart {
        let shifts =
            apart.shifts.iter().map(|(name, value)| format!("{name} {value:+.4}")).collect::<Vec<_>>().join(", ");
        let words = format!(
            "its surfaces and those of {} do not agree within the stated covariance of its pose (p = {:.1e}; its pose would have to \
             change by {shifts}, in metre and radian): they stand beside each other; register it again, or leave it out",
            apart.others.join(", "),
            apart.p_value
        );
        summary.doubts.push(Doubt::about(DoubtKind::Contradiction, apart.frames.join(", "), words));
    }
    let all = summary.fused_points + summary.outvoted_points;
    let share = summary.contradicted_points as f64 / all.max(1) as f64;
    if share > MANY_CONTRADICTIONS {
        let worst = summary.contradictions.iter().max_by_key(|found| found.pairs);
        let worst = worst.map_or_else(String::new, |worst| {
            let distance_mm = 1e3 * worst.median_distance_m;
            format!(
                "; most often {} saw through what {} saw, {distance_mm:.0} mm before it (median)",
                worst.seen_through_by, worst.front
            )
        });
        let words = format!(
            "{} of {all} fused points cannot be there beside what other frames saw ({:.1} %; up to {:.0} % is what one who walks by \
             hides){worst}: something moved, or a pose is wrong by more than stated",
            summary.contradicted_points,
            100.0 * share,
            100.0 * MANY_CONTRADICTIONS,
        );
        summary.doubts.push(Doubt::new(DoubtKind::Contradiction, words));
    }
}
