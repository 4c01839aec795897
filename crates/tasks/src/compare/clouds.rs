//! Distances from one cloud to the other.

use point_cloud::{Cloud, NeighbourTree};
use std::path::Path;

use commands::{Doubt, DoubtKind, Progress};
use icp_registration::{IcpOptions, Metric, Selection, StopReason, align};
use nalgebra::{Isometry3, Point3, Vector3};
use pipeline::{Error, Result};
use range_io::clouds::read_any_cloud;
use rayon::prelude::*;
use serde::Serialize;
use statistics::quantile;

use crate::compare::signed::Surface;
use crate::compare::{CompareAlignment, CompareRequest};

/// Points that take part in a registration; more add time, hardly anything else.
const REGISTERED_POINTS: usize = 30_000;
/// Points of a parallel task.
const CHUNK: usize = 1024;
/// Bins of the histogram, odd so that zero is the middle of one.
const BINS: usize = 61;

/// Distances from one cloud to the other.
#[derive(Debug, Clone, Serialize)]
pub struct CloudComparison {
    /// Points of the first cloud that were compared.
    pub points: usize,
    /// Points of the second cloud that they were compared with.
    pub reference_points: usize,
    /// Points of the first cloud that were left out: flagged, or without position.
    pub left_out: usize,
    /// Points of the first cloud that are farther from the second than the request allows, and left out too.
    pub beyond: usize,
    /// Median distance to the nearest point of the second cloud, metre.
    pub distance_median_m: f64,
    /// 95 % of the distances are below this, metre.
    pub distance_p95_m: f64,
    /// Root mean square distance, metre.
    pub distance_rms_m: f64,
    /// Largest distance, metre.
    pub distance_max_m: f64,
    /// Distances to planes through neighbours, which the density of the points does not enter.
    pub plane: Option<PlaneDistances>,
    /// The registration that went before, where one was asked for.
    pub alignment: Option<CloudAlignment>,
}

/// Distances to planes through the ten nearest points of the reference; not stated beyond its rims.
#[derive(Debug, Clone, Serialize)]
pub struct PlaneDistances {
    /// Points that have a plane below them.
    pub points: usize,
    /// What a positive distance means.
    pub positive: &'static str,
    /// Mean of the signed distances, metre.
    pub mean_m: f64,
    /// Median of the signed distances, metre.
    pub median_m: f64,
    /// Median of the absolute distances, metre.
    pub absolute_median_m: f64,
    /// 95 % of the absolute distances are below this, metre.
    pub absolute_p95_m: f64,
    /// Root mean square, metre.
    pub rms_m: f64,
    /// Largest absolute distance, metre.
    pub absolute_max_m: f64,
    /// How the signed distances are spread.
    pub histogram: DistanceHistogram,
}

/// Counts of signed distances.
#[derive(Debug, Clone, Serialize)]
pub struct DistanceHistogram {
    /// Lower end of the first bin, metre.
    pub low_m: f64,
    /// Upper end of the last bin, metre.
    pub high_m: f64,
    /// Counts of bins of equal width.
    pub counts: Vec<usize>,
    /// Distances below the first bin.
    pub below: usize,
    /// Distances above the last bin.
    pub above: usize,
}

/// The registration of the first cloud onto the second.
#[derive(Debug, Clone, Serialize)]
pub struct CloudAlignment {
    /// Translation of the motion `second = R first + t`, metre.
    pub translation_m: [f64; 3],
    /// Its rotation: axis times angle, degree.
    pub rotation_deg: [f64; 3],
    /// Root mean square residual, metre.
    pub rms_m: f64,
    /// Share of the first cloud that has a partner.
    pub overlap: f64,
    /// Why it cannot be trusted; empty for a sound one.
    pub doubts: Vec<Doubt>,
}

/// Each compared point with its distances, for pictures.
#[derive(Debug)]
pub(crate) struct Deviations {
    pub(crate) points: Vec<Point3<f64>>,
    pub(crate) nearest_m: Vec<f64>,
    /// NaN where there is no plane.
    pub(crate) signed_m: Vec<f64>,
}

/// A cloud as it is compared.
struct Prepared {
    cloud: Cloud,
    left_out: usize,
    viewpoint: Option<Point3<f64>>,
}

pub(crate) fn compare(
    first: &Path,
    second: &Path,
    request: &CompareRequest,
    progress: &dyn Progress,
) -> Result<(CloudComparison, Deviations)> {
    progress.begin("compare clouds", 4);
    let (mut ours, reference) = (prepared(first)?, prepared(second)?);
    progress.advance(1);
    let alignment = if request.alignment == CompareAlignment::None {
        None
    } else {
        let (motion, alignment) = registered(&ours.cloud, &reference.cloud)
            .map_err(|error| Error::comparison(&format!("{} onto {}", first.display(), second.display()), &error))?;
        ours.cloud = ours.cloud.transformed(&motion);
        Some(alignment)
    };
    progress.advance(2);
    let wrong = |error: point_cloud::Error| Error::comparison(&second.display().to_string(), &error);
    let tree = NeighbourTree::new(&reference.cloud.points).map_err(wrong)?;
    let nearest = each(&ours.cloud.points, |point| Ok(tree.nearest(point)?.distance_m)).map_err(wrong)?;
    progress.advance(3);
    let limit = request.max_distance_m.unwrap_or(f64::INFINITY);
    let kept: Vec<usize> = (0..nearest.len()).filter(|&index| nearest[index] <= limit).collect();
    let points: Vec<Point3<f64>> = kept.iter().map(|&index| ours.cloud.points[index]).collect();
    if points.is_empty() {
        let (first, second) = (first.display(), second.display());
        return Err(Error::NothingInCommon(format!("no point of {first} is within {limit} m of {second}")));
    }
    let surface = Surface::new(&reference.cloud, &tree, reference.viewpoint);
    let signed_m = each(&points, |point| surface.distance(point)).map_err(wrong)?;
    progress.advance(4);
    let nearest_m: Vec<f64> = kept.iter().map(|&index| nearest[index]).collect();
    let mut work = nearest_m.clone();
    let comparison = CloudComparison {
        points: points.len(),
        reference_points: reference.cloud.len(),
        left_out: ours.left_out,
        beyond: nearest.len() - kept.len(),
        distance_median_m: quantile(&mut work, 0.5),
        distance_p95_m: quantile(&mut work, 0.95),
        distance_rms_m: root_mean_square(&nearest_m),
        distance_max_m: quantile(&mut work, 1.0),
        plane: plane_distances(&signed_m, surface.positive()),
        alignment,
    };
    Ok((comparison, Deviations { points, nearest_m, signed_m }))
}

/// Reads a cloud and leaves out what is flagged or no point.
fn prepared(path: &Path) -> Result<Prepared> {
    let file = read_any_cloud(path)?;
    let viewpoint = file.world_from_cloud.map(|pose| Point3::from(pose.translation.vector));
    let file = file.in_world();
    let finite = |point: &[f64; 3]| point.iter().all(|value| value.abs() < 1e100);
    let sound =
        |index: &usize| file.flags.as_ref().is_none_or(|flags| flags[*index] == 0) && finite(&file.points[*index]);
    let kept: Vec<usize> = (0..file.len()).filter(sound).collect();
    if kept.is_empty() {
        let count = file.len();
        return Err(Error::Compare(format!(
            "{} has no point to compare, all of its {count} are flagged or without position",
            path.display()
        )));
    }
    let unit = |normal: [f32; 3]| {
        let normal = Vector3::from(normal.map(f64::from));
        normal.try_normalize(1e-6).unwrap_or(Vector3::repeat(f64::NAN))
    };
    let cloud = Cloud {
        points: kept.iter().map(|&index| Point3::from(file.points[index])).collect(),
        normals: file.normals.as_ref().map(|normals| kept.iter().map(|&index| unit(normals[index])).collect()),
        ..Cloud::default()
    };
    Ok(Prepared { cloud, left_out: file.len() - kept.len(), viewpoint })
}

/// A value for each point; the same whatever the number of threads.
fn each(
    points: &[Point3<f64>],
    value: impl Fn(&Point3<f64>) -> std::result::Result<f64, point_cloud::Error> + Sync + Send,
) -> std::result::Result<Vec<f64>, point_cloud::Error> {
    points.par_iter().with_min_len(CHUNK).map(value).collect()
}

fn registered(
    source: &Cloud,
    target: &Cloud,
) -> std::result::Result<(Isometry3<f64>, CloudAlignment), icp_registration::Error> {
    let every = source.len().div_ceil(REGISTERED_POINTS);
    let selection = if every > 1 { Selection::EveryNth(every) } else { Selection::All };
    // Differences are looked at point by point: accuracy comes before time.
    let options = IcpOptions { metric: Metric::PointToPlane, selection, ..IcpOptions::default() };
    let result = align(source, target, &Isometry3::identity(), &options)?;
    let mut doubts = Vec::new();
    if result.stop == StopReason::MaxIterations {
        doubts.push(Doubt::new(DoubtKind::Alignment, "the registration did not settle"));
    }
    if !result.degenerate.is_empty() {
        let words = format!("{} motions are not determined by the surfaces", result.degenerate.len());
        doubts.push(Doubt::new(DoubtKind::Alignment, words));
    }
    let motion = result.target_from_source;
    let alignment = CloudAlignment {
        translation_m: motion.translation.vector.into(),
        rotation_deg: motion.rotation.scaled_axis().map(f64::to_degrees).into(),
        rms_m: result.rms_m,
        overlap: result.overlap,
        doubts,
    };
    Ok((motion, alignment))
}

fn plane_distances(signed_m: &[f64], positive: &'static str) -> Option<PlaneDistances> {
    let mut signed: Vec<f64> = signed_m.iter().copied().filter(|value| value.is_finite()).collect();
    if signed.is_empty() {
        return None;
    }
    let mean_m = signed.iter().sum::<f64>() / signed.len() as f64;
    let rms_m = root_mean_square(&signed);
    let mut absolute: Vec<f64> = signed.iter().map(|value| value.abs()).collect();
    let histogram = histogram(&signed, quantile(&mut absolute, 0.99));
    Some(PlaneDistances {
        points: signed.len(),
        positive,
        mean_m,
        median_m: quantile(&mut signed, 0.5),
        absolute_median_m: quantile(&mut absolute, 0.5),
        absolute_p95_m: quantile(&mut absolute, 0.95),
        rms_m,
        absolute_max_m: quantile(&mut absolute, 1.0),
        histogram,
    })
}

fn histogram(signed: &[f64], reach: f64) -> DistanceHistogram {
    // Two clouds that are the same have all their distances in the middle bin.
    let reach = if reach > 0.0 { reach } else { 1e-6 };
    let mut histogram = DistanceHistogram { low_m: -reach, high_m: reach, counts: vec![0; BINS], below: 0, above: 0 };
    for value in signed {
        let bin = (value + reach) / (2.0 * reach) * BINS as f64;
        match bin {
            b if b < 0.0 => histogram.below += 1,
            b if b >= BINS as f64 => histogram.above += 1,
            b => histogram.counts[b as usize] += 1,
        }
    }
    histogram
}

fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// A length in millimetres with three digits or so.
pub(crate) fn millimetres_of(length_m: f64) -> String {
    let value = 1e3 * length_m;
    match value.abs() {
        v if v >= 100.0 => format!("{value:.0} mm"),
        v if v >= 10.0 => format!("{value:.1} mm"),
        v if v >= 0.1 || v == 0.0 => format!("{value:.2} mm"),
        v if v >= 0.001 => format!("{value:.4} mm"),
        _ => format!("{value:.1e} mm"),
    }
}
