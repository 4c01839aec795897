//! Each input onto the one before.

use std::sync::atomic::{AtomicUsize, Ordering};

use commands::plan::NORMAL_HALF_WIDTH_PX;
use commands::{Doubt, DoubtKind, Progress};
use icp_registration::{IcpResult, StopReason};
use nalgebra::{Isometry3, Point3};
use pipeline::stations::{Start, Station, Surface};
use pipeline::{Error, Result};
use rayon::prelude::*;

use crate::register::input::Input;
use crate::register::summary::{RegisterSummary, RegisteredPair};
use crate::register::{Registered, chain, describe};

/// Below this part of a station with partners, a pair is doubtful.
const LEAST_OVERLAP: f64 = 0.2;

/// A pair that was aligned.
struct Aligned {
    result: IcpResult,
    /// Whether the stated pose led nowhere and another was found without it.
    guess_failed: bool,
}

pub(crate) fn run(input: Input, start: &str, progress: &dyn Progress) -> Result<Registered> {
    let Input { stations, vertical_axis, .. } = input;
    progress.begin("prepare clouds", stations.len());
    let done = AtomicUsize::new(0);
    let prepare = |station: &Station| {
        let surface = Surface::new(station, NORMAL_HALF_WIDTH_PX);
        progress.advance(done.fetch_add(1, Ordering::Relaxed) + 1);
        surface
    };
    let surfaces = stations.par_iter().map(prepare).collect::<Result<Vec<_>>>()?;
    progress.begin("align pairs", stations.len() - 1);
    let done = AtomicUsize::new(0);
    let align = |source: usize| {
        let aligned = align(&stations, &surfaces, source);
        progress.advance(done.fetch_add(1, Ordering::Relaxed) + 1);
        aligned
    };
    let aligned = (1..stations.len()).into_par_iter().map(align).collect::<Vec<Result<_>>>();
    // Of several errors the first, whichever was found first.
    let aligned = aligned.into_iter().collect::<Result<Vec<_>>>()?;
    let steps: Vec<IcpResult> = aligned.iter().map(|pair| pair.result.clone()).collect();
    let poses = chain::along(stations[0].approximate.unwrap_or_default(), &steps);
    let before: Option<Vec<_>> = stations.iter().map(|station| station.approximate).collect();
    let counts: Vec<usize> = surfaces.iter().map(Surface::points).collect();
    let undetermined = |index: usize| match index.checked_sub(1) {
        Some(pair) => steps[pair].degenerate.iter().map(describe::motion).collect(),
        None => Vec::new(),
    };
    let mut summary = RegisterSummary {
        start: if before.is_some() { start.to_owned() } else { "none, sought without".to_owned() },
        datum: describe::datum(&stations[0], before.is_some()),
        stations: describe::stations(&stations, &poses, &counts, (0..stations.len()).map(undetermined).collect()),
        pairs: rows(&stations, &steps),
        doubts: doubts(&stations, &aligned),
        ..RegisterSummary::default()
    };
    describe::extremes(&mut summary);
    let residuals_m = residuals(&stations, &surfaces, &steps);
    for (index, row) in summary.pairs.iter_mut().enumerate() {
        row.mean_m = mean(&distances(&stations[index + 1], &surfaces[index], &steps[index], false));
    }
    Ok(Registered { stations, poses, before, residuals_m, vertical_axis, summary })
}

/// Poses of all stations, each aligned onto the one before; `None` where one of these alignments cannot be trusted.
pub(crate) fn chained(stations: &[Station]) -> Option<Vec<Isometry3<f64>>> {
    let prepare = |station: &Station| Surface::new(station, NORMAL_HALF_WIDTH_PX).ok();
    let surfaces = stations.par_iter().map(prepare).collect::<Option<Vec<_>>>()?;
    let align = |source: usize| {
        let aligned = align(stations, &surfaces, source).ok()?;
        aligned.result.is_trustworthy().then_some(aligned.result)
    };
    let steps = (1..stations.len()).into_par_iter().map(align).collect::<Option<Vec<IcpResult>>>()?;
    let chain = chain::along(Isometry3::identity(), &steps);
    Some(chain.into_iter().map(|station| station.world_from_camera).collect())
}

fn align(stations: &[Station], surfaces: &[Surface], source: usize) -> Result<Aligned> {
    let target = source - 1;
    let (onto, moved) = (&surfaces[target], &surfaces[source]);
    let names = format!("{} onto {}", stations[source].name, stations[target].name);
    let stated = stations[target].approximate.zip(stations[source].approximate);
    let from_stated = stated.and_then(|(target, source)| {
        let guess = Start::Guess(target.inverse() * source);
        onto.align(moved, guess).ok()
    });
    if let Some(result) = from_stated.as_ref().filter(|result| result.is_trustworthy()) {
        return Ok(Aligned { result: result.clone(), guess_failed: false });
    }
    let found = onto.search(moved).map_err(multiview_registration::Error::from);
    let found = found.and_then(|start| Ok(onto.align(moved, start)?));
    if let Some(result) = from_stated
        && !found.as_ref().is_ok_and(|found| found.overlap > result.overlap)
    {
        return Ok(Aligned { result, guess_failed: false });
    }
    let result = found.map_err(|error| {
        let stated = if stated.is_some() { ", neither from the start poses nor without" } else { "" };
        Error::Register(format!(
            "{names}: {error}{stated}. Do the two see the same surfaces? Name the inputs in an order in which each \
             overlaps the one before, give start poses with --guess FILE, or let --multi find out which overlap"
        ))
    })?;
    Ok(Aligned { result, guess_failed: stated.is_some() })
}

fn rows(stations: &[Station], steps: &[IcpResult]) -> Vec<RegisteredPair> {
    let row = |(index, step): (usize, &IcpResult)| RegisteredPair {
        target: stations[index].name.clone(),
        source: stations[index + 1].name.clone(),
        overlap: step.overlap,
        rms_m: step.rms_m,
        mean_m: None,
        undetermined: step.degenerate.iter().map(describe::motion).collect(),
    };
    steps.iter().enumerate().map(row).collect()
}

/// What a reader should know before the poses are used.
fn doubts(stations: &[Station], aligned: &[Aligned]) -> Vec<Doubt> {
    let mut doubts = Vec::new();
    for (index, pair) in aligned.iter().enumerate() {
        let names = format!("{} onto {}", stations[index + 1].name, stations[index].name);
        let result = &pair.result;
        let mut doubt = |words: String| doubts.push(Doubt::about(DoubtKind::Alignment, &names, words));
        if pair.guess_failed {
            doubt("the start poses lead to no sound alignment, the pose was found without them".to_owned());
        }
        if result.stop == StopReason::MaxIterations {
            doubt("the iterations did not settle, the pose may be wrong".to_owned());
        }
        if result.overlap < LEAST_OVERLAP {
            let percent = 100.0 * result.overlap;
            doubt(format!("only {percent:.0} % of the points have a partner, the pose may be wrong"));
        }
        let open: Vec<String> = result.degenerate.iter().map(describe::motion).collect();
        if !open.is_empty() {
            let open = open.join("; ");
            doubt(format!("the surfaces leave open {open}: the pose is a guess there"));
        }
    }
    doubts
}

/// Distances of all points of a station from a neighbour's surface, in the order of its file; NaN where there is none.
///
/// `backwards`: the station is the target of the pair and the surface its source.
pub(crate) fn distances(station: &Station, surface: &Surface, pair: &IcpResult, backwards: bool) -> Vec<f64> {
    let pose = if backwards { pair.target_from_source.inverse() } else { pair.target_from_source };
    let distance = |point: &[f64; 3]| {
        let moved = pose * Point3::from(*point);
        surface.distance(&moved, pair.rms_m).unwrap_or(f64::NAN)
    };
    station.usable_points().par_iter().with_min_len(256).map(distance).collect()
}

fn mean(values: &[f64]) -> Option<f64> {
    let (sum, count) = values.iter().filter(|v| v.is_finite()).fold((0.0, 0.0), |(sum, n), v| (sum + v, n + 1.0));
    (count > 0.0).then(|| sum / count)
}

/// For each station the distances from its neighbours' surfaces, averaged where both have one.
fn residuals(stations: &[Station], surfaces: &[Surface], steps: &[IcpResult]) -> Vec<Vec<f64>> {
    let of = |index: usize| {
        let mut sets = Vec::new();
        if let Some(pair) = index.checked_sub(1) {
            sets.push(distances(&stations[index], &surfaces[pair], &steps[pair], false));
        }
        if let Some(pair) = steps.get(index) {
            sets.push(distances(&stations[index], &surfaces[index + 1], pair, true));
        }
        let at = |point: usize| mean(&sets.iter().map(|set| set[point]).collect::<Vec<_>>()).unwrap_or(f64::NAN);
        (0..stations[index].file.points.len()).map(at).collect()
    };
    (0..stations.len()).map(of).collect()
}
