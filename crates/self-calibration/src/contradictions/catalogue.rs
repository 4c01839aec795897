//! The catalogue of causes: what a network would be if one named thing were otherwise.

use crate::findings::contradiction::CauseKind;
use crate::{Network, Sighting};

/// A network with one thing changed.
pub(crate) struct Alternative {
    pub(crate) kind: CauseKind,
    /// What the observations would be, for "... fit if they are ...".
    pub(crate) words: String,
    pub(crate) remedy: &'static str,
    pub(crate) network: Network,
}

/// Units that are met instead of metres, and how many of them make one.
const UNITS: [(&str, f64); 2] = [("millimetres", 1e3), ("centimetres", 1e2)];

/// Share of a table's extent up to which the deviations of its coordinates can be: beyond, they are of the coordinates' unit. A field
/// of targets is measured to 1e-3 of its extent and better; in another unit deviations are 10 and more times its extent.
const LARGEST_DEVIATION: f64 = 0.03;

/// Stands for a range that would be negative, metre.
const SHORTEST: f64 = 1e-3;

const RANGE_COLUMN: &str = "mend the column `range` of observations.csv";
const IMAGE_COLUMNS: &str = "mend the columns `col` and `row` of observations.csv";
const LABELS: &str = "mend the column `target` of observations.csv";

/// What may be wrong with the sightings of one station, or with all.
pub(crate) fn of_sightings(network: &Network, station: Option<usize>) -> Vec<Alternative> {
    let mut out = Vec::new();
    let is_own = |seen: &Sighting| station.is_none_or(|station| seen.station == station);
    let ranged = network.sightings.iter().any(|seen| is_own(seen) && seen.range_m.is_some());
    let mut add = |kind: CauseKind, words: String, remedy, change: &dyn Fn(&mut Sighting)| {
        if kind.is_of_ranges() && !ranged {
            return;
        }
        let mut network = network.clone();
        network.sightings.iter_mut().filter(|seen| is_own(seen)).for_each(change);
        out.push(Alternative { kind, words, remedy, network });
    };
    for (unit, factor) in UNITS {
        let words = format!("the ranges fit if they are {unit} instead of metres");
        add(CauseKind::RangeUnit, words, RANGE_COLUMN, &|seen| seen.range_m = seen.range_m.map(|range| range / factor));
    }
    let camera = network.camera;
    let depth = "the ranges fit if they are depths (along the viewing axis) instead of distances from the camera";
    add(CauseKind::DepthForRange, depth.to_owned(), RANGE_COLUMN, &|seen| {
        if let (Some(pixel), Some(depth)) = (seen.pixel, seen.range_m) {
            seen.range_m = Some(depth / -camera.ray(pixel).z);
        }
    });
    let interval = network.range_model.ambiguity_interval_m;
    if interval.is_finite() {
        for (more, way) in [(interval, "shorter"), (-interval, "longer")] {
            let words = format!("the ranges fit if they are one ambiguity interval ({interval:.3} m) {way}");
            add(CauseKind::WholeIntervals, words, RANGE_COLUMN, &|seen| {
                // A range that cannot be so much shorter contradicts all the more.
                seen.range_m = seen.range_m.map(|range| (range - more).max(SHORTEST));
            });
        }
    }
    let [last_col, last_row] = [camera.format.width, camera.format.height].map(|count| count as f64 - 1.0);
    let exchanged = "the image points fit if columns and rows are exchanged";
    add(CauseKind::ColumnsExchanged, exchanged.to_owned(), IMAGE_COLUMNS, &|seen| {
        seen.pixel = seen.pixel.map(|[col, row]| [row, col]);
        seen.sigma_pixel.swap(0, 1);
    });
    let rows = "the image points fit if rows are counted from the other edge: the image is mirrored";
    add(CauseKind::Mirrored, rows.to_owned(), IMAGE_COLUMNS, &|seen| {
        seen.pixel = seen.pixel.map(|[col, row]| [col, last_row - row]);
    });
    let columns = "the image points fit if columns are counted from the other edge: the image is mirrored";
    add(CauseKind::Mirrored, columns.to_owned(), IMAGE_COLUMNS, &|seen| {
        seen.pixel = seen.pixel.map(|[col, row]| [last_col - col, row]);
    });
    out
}

/// Labels of one station that belong to its next or its previous row, or to the next or previous name.
pub(crate) fn of_labels(network: &Network, station: usize) -> Vec<Alternative> {
    let own: Vec<usize> = (0..network.sightings.len()).filter(|&i| network.sightings[i].station == station).collect();
    let mut by_name: Vec<usize> = (0..network.targets.len()).collect();
    by_name.sort_by(|a, b| network.targets[*a].name.cmp(&network.targets[*b].name));
    let mut place = vec![0; by_name.len()];
    by_name.iter().enumerate().for_each(|(position, &target)| place[target] = position);
    let mut out = Vec::new();
    for (step, row, name) in
        [(1, "the row below", "the next name"), (own.len().saturating_sub(1), "the row above", "the previous name")]
    {
        let mut shifted = network.clone();
        for (position, &index) in own.iter().enumerate() {
            shifted.sightings[index].target = network.sightings[own[(position + step) % own.len()]].target;
        }
        let words = format!("the observations fit if each has the target of {row}: names are shifted");
        out.push(Alternative { kind: CauseKind::LabelsShifted, words, remedy: LABELS, network: shifted });
        let mut renamed = network.clone();
        let count = by_name.len();
        let step = if step == 1 { 1 } else { count - 1 };
        for &index in &own {
            let target = &mut renamed.sightings[index].target;
            *target = by_name[(place[*target] + step) % count];
        }
        let words = format!("the observations fit if each has {name} in the list of targets: names are shifted");
        out.push(Alternative { kind: CauseKind::LabelsShifted, words, remedy: LABELS, network: renamed });
    }
    out
}

/// What may be wrong with camera and coordinates, which all stations share.
pub(crate) fn of_tables(network: &Network) -> Vec<Alternative> {
    let mut out = Vec::new();
    let c = network.camera.interior.principal_distance_mm;
    for factor in [1e-3, 1e3] {
        let mut other = network.clone();
        other.camera.interior.principal_distance_mm = c * factor;
        let words = format!(
            "the image points fit if the principal distance is {} mm instead of {c} mm: it and the pixel pitch are not in \
             one unit",
            c * factor
        );
        let remedy =
            "mend `principal_distance_mm` or `pixel_pitch_mm` of the camera in survey.ron, or of calibration.ron";
        out.push(Alternative { kind: CauseKind::PrincipalDistanceUnit, words, remedy, network: other });
    }
    if network.targets.iter().all(|target| target.point.is_none()) {
        return out;
    }
    let [extent, deviation] = extent_and_deviation(network);
    let mut add = |kind, words: String, axes: [usize; 3], factors: [f64; 3], of_deviations: f64| {
        let mut other = network.clone();
        for target in &mut other.targets {
            if let Some(point) = &mut target.point {
                let old = *point;
                (0..3).for_each(|axis| point[axis] = factors[axis] * old[axes[axis]]);
            }
            if let Some(covariance) = &mut target.covariance {
                let old = *covariance;
                *covariance = nalgebra::Matrix3::from_fn(|i, j| {
                    of_deviations.powi(2) * factors[i].signum() * factors[j].signum() * old[(axes[i], axes[j])]
                });
            }
        }
        let remedy = "mend targets.csv";
        out.push(Alternative { kind, words, remedy, network: other });
    };
    for (unit, factor) in UNITS {
        let words = format!("the targets fit if their coordinates are {unit} instead of metres");
        // Deviations may be in metres all the same; free of them, targets would fit anything.
        let is_small = deviation <= LARGEST_DEVIATION * extent / factor;
        add(CauseKind::CoordinateUnit, words, [0, 1, 2], [1.0 / factor; 3], if is_small { 1.0 } else { 1.0 / factor });
    }
    for (names, axes) in [("x and y", [1, 0, 2]), ("y and z", [0, 2, 1]), ("x and z", [2, 1, 0])] {
        let words = format!("the targets fit if their {names} are exchanged: the coordinates are mirrored");
        add(CauseKind::CoordinateAxes, words, axes, [1.0; 3], 1.0);
    }
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let mut factors = [1.0; 3];
        factors[axis] = -1.0;
        let words = format!("the targets fit if {name} has the other sign: the coordinates are mirrored");
        add(CauseKind::CoordinateAxes, words, [0, 1, 2], factors, 1.0);
    }
    out
}

/// Distance of the outermost target from the first, and the largest deviation of a coordinate, metre.
fn extent_and_deviation(network: &Network) -> [f64; 2] {
    let points = || network.targets.iter().filter_map(|target| target.point);
    let extent = points().next().map_or(0.0, |first| points().map(|point| (point - first).norm()).fold(0.0, f64::max));
    let covariances = network.targets.iter().filter_map(|target| target.covariance);
    [extent, covariances.map(|covariance| covariance.diagonal().max()).fold(0.0, f64::max).sqrt()]
}
