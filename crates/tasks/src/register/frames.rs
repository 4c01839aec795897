//! All stations at once by pairs of their frames, where surfaces differ by more than the noise of their points.

use commands::plan::NORMAL_HALF_WIDTH_PX;
use multiview_registration::{FrameRegistration, PairAlignment};
use nalgebra::Isometry3;
use pipeline::Result;
use pipeline::stations::{Station, Surface, not_placed, register_as_frames, surface, unchecked};
use pipeline::survey::StationPose;
use projective_registration::OrganisedFrame;
use rayon::prelude::*;

use crate::register::summary::{RegisterSummary, RegisteredLoop, RegisteredPair};
use crate::register::{Registered, describe, pairs};

/// The stations registered as frames; `None` where they are none, or no two of them belong together.
pub(crate) fn found(stations: &[Station], before: Option<&[Isometry3<f64>]>) -> Option<FrameRegistration> {
    let frame = |station: &Station| surface::frame(station, station.projection.as_ref()?);
    let frames: Vec<OrganisedFrame> = stations.par_iter().map(frame).collect::<Option<_>>()?;
    register_as_frames(&frames, before).ok()
}

/// The stations that were placed, with what is known of them; the others are named in the doubts.
pub(crate) fn registered(
    stations: Vec<Station>,
    before: Option<Vec<Isometry3<f64>>>,
    vertical_axis: usize,
    result: &FrameRegistration,
) -> Result<Registered> {
    let pose = |k: usize| {
        let placed = result.frames[k]?;
        Some(StationPose { world_from_camera: placed.world_from_frame, covariance: Some(placed.covariance) })
    };
    let poses: Vec<StationPose> = (0..stations.len()).filter_map(pose).collect();
    let mut summary = summary(result, &stations);
    summary.datum = describe::datum(&stations[result.datum], before.is_some());
    let mut start = if before.is_some() { "poses of the input" } else { "none, order of the stations" }.to_owned();
    start += "; pairs of frames, since surfaces differ by more than the noise of their points";
    summary.start = start;
    let residuals_m = residuals(result, &stations)?;
    let is_placed = |k: &usize| result.frames[*k].is_some();
    let before = before.map(|before| (0..before.len()).filter(is_placed).map(|k| before[k]).collect());
    let mut placed = Vec::with_capacity(poses.len());
    for (station, frame) in stations.into_iter().zip(&result.frames) {
        if frame.is_some() {
            placed.push(station);
        }
    }
    let counts: Vec<usize> =
        placed.iter().map(|s| s.usable_points().iter().filter(|point| point[0].is_finite()).count()).collect();
    let mut rows = describe::stations(&placed, &poses, &counts, Vec::new());
    let verdicts = result.placements.stations.iter().zip(&result.frames).filter(|(_, frame)| frame.is_some());
    for (row, (placement, _)) in rows.iter_mut().zip(verdicts) {
        row.placement = describe::placement(placement);
    }
    summary.stations = rows;
    describe::extremes(&mut summary);
    Ok(Registered { stations: placed, poses, before, residuals_m, vertical_axis, summary })
}

fn summary(result: &FrameRegistration, stations: &[Station]) -> RegisterSummary {
    let name = |index: usize| stations[index].name.clone();
    let row = |pair: &PairAlignment| RegisteredPair {
        target: name(pair.target),
        source: name(pair.source),
        overlap: pair.result.overlap,
        rms_m: pair.result.rms_m,
        mean_m: None,
        undetermined: Vec::new(),
    };
    let closures = result.loops.iter().map(|closure| RegisteredLoop {
        stations: closure.stations.iter().map(|&station| name(station)).collect(),
        translation_m: closure.translation_m,
        rotation_deg: closure.rotation_rad.to_degrees(),
    });
    let left_out = result.refused.iter().map(|p| format!("{} onto {}: {}", name(p.source), name(p.target), p.reason));
    let unplaced = result.unplaced.iter().map(|out| not_placed(&stations[out.frame].name, &out.reason));
    let unchecked = result.unchecked.iter().map(|pair| unchecked(pair, name));
    let placed = result.frames.iter().flatten().count() as i64;
    RegisterSummary {
        pairs: result.pairs.iter().map(row).collect(),
        refused: left_out.collect(),
        loops: closures.collect(),
        sigma0: Some(result.variance_factor.sqrt()),
        redundancy: Some(6 * (result.pairs.len() as i64 + 1 - placed)),
        doubts: unplaced.chain(unchecked).collect(),
        ..RegisterSummary::default()
    }
}

/// Distances of the points of each placed station from the one that it shares most with.
fn residuals(result: &FrameRegistration, stations: &[Station]) -> Result<Vec<Vec<f64>>> {
    let of = |k: usize| {
        let own = result.pairs.iter().filter(|pair| pair.target == k || pair.source == k);
        let Some(pair) = own.max_by(|a, b| a.result.overlap.total_cmp(&b.result.overlap)) else {
            return Ok(vec![f64::NAN; stations[k].file.points.len()]);
        };
        let backwards = pair.target == k;
        let other = if backwards { pair.source } else { pair.target };
        let surface = Surface::new(&stations[other], NORMAL_HALF_WIDTH_PX)?;
        Ok(pairs::distances(&stations[k], &surface, &pair.result, backwards))
    };
    (0..stations.len()).filter(|k| result.frames[*k].is_some()).map(of).collect()
}
