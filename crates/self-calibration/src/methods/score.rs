//! Score tests of usual terms that are not estimated: what the sum of squares would fall by with them, from the residuals
//! alone.

use std::collections::BTreeSet;

use adjust::Solution;
use calibration_network::functional_model::{
    Calibration, RangeSet, SINES, Setup, Solved, Source, camera_names, modelled_pixel,
};
use statistics::Distribution;

use crate::methods::reference::Reference;
use crate::{Component, GroupQuality, Result, TermScore};

/// Range terms that are looked at.
const RANGE_TERMS: [&str; 9] = ["d0", "d2", "d3", "d4", "d5", "d6", "d7", "e1", "e2"];
/// Terms that are added together: of radial ones none without those of lower order.
const CAMERA_GROUPS: [&[&str]; 7] =
    [&["xp", "yp"], &["c"], &["k1"], &["k1", "k2"], &["k1", "k2", "k3"], &["p1", "p2"], &["b1", "b2"]];
const RANGE_GROUPS: [&[&str]; 7] = [
    &["d0"],
    &["d2", "d3"],
    &["d4", "d5"],
    &["d6", "d7"],
    &["d4", "d5", "d6", "d7"],
    &["d2", "d3", "d4", "d5", "d6", "d7"],
    &["e1", "e2"],
];

/// Scores of the terms that this adjustment does not estimate.
pub(crate) fn term_scores(setup: &Setup<'_>, solved: &Solved, groups: &[GroupQuality]) -> Result<Vec<TermScore>> {
    let found = setup.calibration_found(solved)?;
    let geometry = solved.geometry()?;
    let row = |index: usize| {
        let row = &solved.rows[index];
        let Source::Sighting(sighting) = row.source else { return None };
        let seen = &setup.network.sightings[sighting];
        let pose = &geometry.stations[seen.station];
        // At the measured image point the derivatives would carry its noise, which is that of the residuals: among
        // hundreds of thousands of values a term would seem to be shown.
        let pixel = modelled_pixel(&found.camera, pose, &geometry.targets[seen.target]?)?;
        let at = about_principal_point(&found, pixel);
        Some(match row.component {
            Component::Col => (0, image_row(&found, at, 0)),
            Component::Row => (0, image_row(&found, at, 1)),
            _ => {
                let set = setup.set_of(seen.station);
                let distance = geometry.distance(seen.station, seen.target);
                (camera_names().len() + set * RANGE_TERMS.len(), range_row(&found.sets[set], distance, at))
            }
        })
    };
    let mut scores = scored(setup, &solved.solution, row, &CAMERA_GROUPS, variance_factor(groups, false));
    if (0..setup.network.sightings.len()).any(|index| setup.uses_range(index)) {
        scores.extend(scored(setup, &solved.solution, row, &RANGE_GROUPS, variance_factor(groups, true)));
    }
    Ok(scores)
}

/// Scores of the range terms that a second step does not estimate. The references follow `first` other values.
pub(crate) fn range_scores(
    setup: &Setup<'_>,
    solution: &Solution,
    reference: &Reference,
    first: usize,
) -> Vec<TermScore> {
    let row = |index: usize| {
        let row = index.checked_sub(first)?;
        let (&sighting, value) = (reference.sightings.get(row)?, reference.values[row]);
        let set = setup.set_of(setup.network.sightings[sighting].station);
        let at = about_principal_point(&setup.calibration, reference.pixels[row]?);
        let values = range_row(&setup.calibration.sets[set], value, at);
        Some((camera_names().len() + set * RANGE_TERMS.len(), values))
    };
    let factor = solution.sigma0().map_or(1.0, |sigma0| sigma0 * sigma0);
    scored(setup, solution, row, &RANGE_GROUPS, factor)
}

/// `row` gives the derivatives of a value by the terms of one block, and where the block begins.
fn scored(
    setup: &Setup<'_>,
    solution: &Solution,
    row: impl Fn(usize) -> Option<(usize, Vec<f64>)>,
    groups: &[&[&'static str]],
    factor: f64,
) -> Vec<TermScore> {
    let sets = (0..setup.calibration.sets.len()).flat_map(|_| RANGE_TERMS);
    let names: Vec<&str> = camera_names().into_iter().chain(sets).collect();
    let wanted: BTreeSet<&str> = groups.iter().flat_map(|group| group.iter().copied()).collect();
    let is_left_out = |column: &usize| wanted.contains(names[*column]) && leaves_out(setup, names[*column]);
    let columns: Vec<usize> = (0..names.len()).filter(is_left_out).collect();
    let left_out = solution.left_out(columns.len(), |index, out| {
        let Some((first, values)) = row(index) else { return };
        for (out, column) in out.iter_mut().zip(&columns) {
            *out = column.checked_sub(first).and_then(|at| values.get(at)).copied().unwrap_or(0.0);
        }
    });
    let score = |group: &&[&'static str]| {
        let terms: Vec<&str> = group.iter().copied().filter(|name| leaves_out(setup, name)).collect();
        let chosen: Vec<usize> = (0..columns.len()).filter(|&i| terms.contains(&names[columns[i]])).collect();
        let statistic = left_out.statistic(&chosen)? / factor;
        let p = Distribution::ChiSquared { dof: chosen.len() as f64 }.survival(statistic);
        let delta_bic = chosen.len() as f64 * (solution.observations() as f64).ln() - statistic;
        Some(TermScore { terms: terms.into_iter().map(str::to_owned).collect(), statistic, p, delta_bic })
    };
    groups.iter().filter_map(score).collect()
}

/// Whether a term might be estimated and is not: a spline stands in place of the sines, a surface in place of the tilt.
fn leaves_out(setup: &Setup<'_>, name: &str) -> bool {
    let has = |start: &str| setup.estimated.iter().any(|known| known.starts_with(start));
    let replaced = has("s0") && SINES.contains(&name) || has("g10") && ["e1", "e2"].contains(&name);
    !replaced && !setup.estimated.contains(name)
}

/// Variance factor of ranges or of image points.
fn variance_factor(groups: &[GroupQuality], of_ranges: bool) -> f64 {
    let names: &[&str] = if of_ranges { &["range"] } else { &["col", "row"] };
    let own = groups.iter().filter(|group| names.contains(&group.name.as_str()));
    let (squares, redundancy) = own.fold((0.0, 0.0), |(squares, redundancy), group| {
        let square = group.sigma0.map_or(0.0, |scale| scale * scale * group.redundancy);
        (squares + square, redundancy + group.redundancy)
    });
    if redundancy > 0.0 && squares > 0.0 { squares / redundancy } else { 1.0 }
}

/// Image coordinates about the principal point, mm.
fn about_principal_point(calibration: &Calibration, pixel: [f64; 2]) -> [f64; 2] {
    let [x, y] = calibration.camera.format.image_from_pixel(pixel);
    let [xp, yp] = calibration.camera.interior.principal_point_mm;
    [x - xp, y - yp]
}

/// Of an observed column (axis 0) or row (axis 1) by the camera's terms.
fn image_row(calibration: &Calibration, [x, y]: [f64; 2], axis: usize) -> Vec<f64> {
    let c = calibration.camera.interior.principal_distance_mm;
    let pitch = calibration.camera.format.pixel_pitch_mm[axis];
    let r2 = x * x + y * y;
    let own = [x, y][axis];
    let value = |name: &str| match (name, axis) {
        ("xp", 0) | ("yp", 1) => 1.0,
        ("c", _) => own / c,
        ("k1", _) => own * r2,
        ("k2", _) => own * r2 * r2,
        ("k3", _) => own * r2 * r2 * r2,
        ("p1", 0) | ("p2", 1) => r2 + 2.0 * own * own,
        ("p1" | "p2", _) => 2.0 * x * y,
        ("b1", 0) => x,
        ("b2", 0) => y,
        _ => 0.0,
    };
    // Rows are counted downwards.
    let in_pixels = if axis == 0 { 1.0 / pitch } else { -1.0 / pitch };
    camera_names().into_iter().map(|name| in_pixels * value(name)).collect()
}

/// Of an observed range by the terms of its set.
fn range_row(set: &RangeSet, distance_m: f64, [x, y]: [f64; 2]) -> Vec<f64> {
    let interval = set.model.ambiguity_interval_m;
    let wave = |order: f64| (order * std::f64::consts::TAU * distance_m / interval).sin_cos();
    let [(s1, c1), (s2, c2), (s4, c4)] = [1.0, 2.0, 4.0].map(wave);
    vec![1.0, s1, c1, s2, c2, s4, c4, x, y]
}
