//! Ranges of another scale than poses and coordinates have: those of another modulation frequency.

use std::collections::BTreeMap;

use calibration_network::functional_model::{TILT_M, WAVE_M};
use nalgebra::{SMatrix, SVector, Vector3};
use statistics::{mad_scale, upper_median};

use crate::findings::contradiction::{Cause, CauseKind};
use crate::{CalibrationOutcome, Component, Network, Verdict};

/// Lengths by tape or plan are right within one percent; frequencies differ by more than this.
const SMALLEST_CHANGE: f64 = 0.03;
/// Standard deviations beyond which a scale is another: one of two million sound ones.
const CLEAR: f64 = 5.0;
/// Share of the stations that have to agree.
const MOST: f64 = 2.0 / 3.0;
/// Places from which a scale is taken.
const FEWEST: usize = 4;
/// Unknowns of the range error about its scale: offset, scale, three waves, tilt.
const UNKNOWNS: usize = 10;

/// Stations and targets that came out in another size than they were given, each of them as a whole.
pub(super) fn by_size(network: &Network, outcome: &CalibrationOutcome) -> Option<Cause> {
    let targets: BTreeMap<&str, Vector3<f64>> =
        network.targets.iter().filter_map(|target| Some((target.name.as_str(), target.point?.coords))).collect();
    let stations: BTreeMap<&str, Vector3<f64>> = network
        .stations
        .iter()
        .filter_map(|station| Some((station.name.as_str(), station.world_from_camera?.translation.vector)))
        .collect();
    let targets = outcome.targets.iter().filter_map(|own| Some((*targets.get(own.name.as_str())?, own.point.coords)));
    let stations = outcome
        .stations
        .iter()
        .filter_map(|own| Some((*stations.get(own.name.as_str())?, own.world_from_camera.translation.vector)));
    let scales = [scale(&targets.collect::<Vec<_>>()), scale(&stations.collect::<Vec<_>>())];
    // Either may be wrong where the other is right.
    let known: Vec<[f64; 2]> = scales.into_iter().flatten().collect();
    let is_other = |[scale, sigma]: &[f64; 2]| {
        let off = scale.ln().abs();
        off > SMALLEST_CHANGE && off > CLEAR * sigma / scale
    };
    let [scale, sigma] = *known.first()?;
    known.iter().all(is_other).then(|| Cause {
        kind: CauseKind::ModulationFrequency,
        station: None,
        names: Vec::new(),
        words: format!(
            "the ranges make the network {scale:.3} times as large as the given coordinates: the frequency that they were \
             computed with is {:.3} times that of the camera, or the coordinates are in another unit",
            1.0 / scale
        ),
        remedy: "mend `modulation_hz` and the column `range`, or the coordinates of targets.csv and stations.csv",
        log_odds: 0.5 * (scale.ln() * scale / sigma).powi(2),
    })
}

/// Found over given size, and its deviation as the places scatter.
fn scale(places: &[(Vector3<f64>, Vector3<f64>)]) -> Option<[f64; 2]> {
    let count = places.len() as f64;
    if places.len() < FEWEST {
        return None;
    }
    let sum = places.iter().fold((Vector3::zeros(), Vector3::zeros()), |(a, b), (given, found)| (a + given, b + found));
    let (given, found) = (sum.0 / count, sum.1 / count);
    let ratios: Vec<f64> = places.iter().map(|pair| (pair.1 - found).norm() / (pair.0 - given).norm()).collect();
    let scale = upper_median(&mut ratios.clone());
    let spread = mad_scale(&mut ratios.iter().map(|ratio| (ratio - scale).abs()).collect::<Vec<f64>>());
    // The median has 1.25 times the deviation of the mean; rounding leaves no spread at all.
    let sigma = (1.25 * spread / count.sqrt()).max(1e-9);
    (scale.is_finite() && sigma.is_finite()).then_some([scale, sigma])
}

/// Ranges that are a multiple of the distances between stations and targets, where something else than ranges gives these
/// their scale. What waves of the usual size may imitate is not told.
pub(super) fn by_slope(network: &Network, outcome: &CalibrationOutcome) -> Option<Cause> {
    let known = network.targets.iter().any(|target| target.covariance.is_some())
        || network.stations.iter().any(|station| station.covariance.is_some())
        || !network.distances.is_empty();
    // Errors by the amplitude go with the distance as well.
    let plain =
        outcome.range_models.iter().all(|(_, model)| model.hyperbola.is_none() && model.further.shape().is_empty());
    if !known || !plain || !is_common(outcome) {
        return None;
    }
    let interval = network.range_model.ambiguity_interval_m;
    let format = &network.camera.format;
    let own = outcome.residuals.iter().filter(|own| own.component == Component::Range);
    let used = own.filter(|own| own.verdict == Verdict::Used && own.uncorrected_m.is_finite());
    let mut normal = SMatrix::<f64, UNKNOWNS, UNKNOWNS>::zeros();
    let mut right = SVector::<f64, UNKNOWNS>::zeros();
    let corner = format.image_from_pixel([0.0, 0.0]);
    let corner = corner[0].hypot(corner[1]);
    let scale = outcome.groups.iter().find(|group| group.name == "range").and_then(|group| group.sigma0);
    let scale = scale.unwrap_or(1.0).max(1.0);
    for own in used {
        let distance = own.range_m - own.uncorrected_m;
        let [x, y] = format.image_from_pixel(own.pixel);
        let wave = |order: f64| (order * std::f64::consts::TAU * distance / interval).sin_cos();
        let [(s1, c1), (s2, c2), (s4, c4)] = [1.0, 2.0, 4.0].map(wave);
        let row = SVector::from([1.0, distance, s1, c1, s2, c2, s4, c4, x, y]);
        let weight = (scale * own.sigma).powi(-2);
        normal += weight * row * row.transpose();
        right += weight * own.uncorrected_m * row;
    }
    for wave in 2..8 {
        normal[(wave, wave)] += WAVE_M.powi(-2);
    }
    for tilt in 8..10 {
        normal[(tilt, tilt)] += (TILT_M / corner).powi(-2);
    }
    let inverse = normal.try_inverse()?;
    let (slope, sigma) = ((inverse * right)[1], inverse[(1, 1)].sqrt());
    (slope.abs() > SMALLEST_CHANGE && slope.abs() > CLEAR * sigma).then(|| Cause {
        kind: CauseKind::ModulationFrequency,
        station: None,
        names: Vec::new(),
        words: format!(
            "the ranges are {:.3} times as long as the distances between stations and targets: the frequency that they \
             were computed with is {:.3} times that of the camera, or the known lengths are in another unit",
            1.0 + slope,
            1.0 / (1.0 + slope)
        ),
        remedy: "mend `modulation_hz` and the column `range`, or the known coordinates and distances",
        log_odds: 0.5 * (slope / sigma).powi(2),
    })
}

/// Whether the ranges of most stations are as many times too long.
fn is_common(outcome: &CalibrationOutcome) -> bool {
    let mut stations: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    let own = outcome.residuals.iter().filter(|own| own.component == Component::Range);
    for own in own.filter(|own| own.uncorrected_m.is_finite()) {
        stations.entry(own.station.as_str()).or_default().push(own.range_m / (own.range_m - own.uncorrected_m));
    }
    let ratios: Vec<f64> = stations.into_values().map(|mut ratios| upper_median(&mut ratios).ln()).collect();
    let typical = upper_median(&mut ratios.clone());
    let agreeing = ratios.iter().filter(|ratio| (*ratio - typical).abs() < 0.5 * typical.abs()).count();
    typical.abs() > SMALLEST_CHANGE && agreeing as f64 >= MOST * ratios.len() as f64
}

/// Steps of the ambiguity interval that is looked for, as a share of it: a wave of a quarter of it is then off by less than
/// a third of a radian over its length.
const STEP: f64 = 0.02;
/// Largest factor between given and found ambiguity interval.
const LARGEST_FACTOR: f64 = 4.0;
/// Finer steps about the best.
const FINE: i32 = 10;

/// The ambiguity interval whose waves of lengths U/2 and U/4 the residuals of the ranges show most.
pub(super) fn other_interval(network: &Network, outcome: &CalibrationOutcome) -> Option<f64> {
    let given = network.range_model.ambiguity_interval_m;
    let own = outcome.residuals.iter().filter(|own| own.component == Component::Range);
    let used = own.filter(|own| own.verdict == Verdict::Used && own.uncorrected_m.is_finite());
    let rows: Vec<[f64; 3]> = used.map(|own| [own.range_m - own.uncorrected_m, own.residual, own.sigma]).collect();
    let score = |interval: f64| (interval, statistic(&rows, given, interval));
    let best = |tried: &mut dyn Iterator<Item = f64>| {
        tried.map(score).filter(|(_, score)| score.is_finite()).max_by(|a, b| a.1.total_cmp(&b.1))
    };
    let count = (LARGEST_FACTOR.ln() / STEP) as i32;
    let (coarse, _) = best(&mut (-count..=count).map(|step| given * (STEP * f64::from(step)).exp()))?;
    let fine = (-FINE..=FINE).map(|step| coarse * (STEP * f64::from(step) / f64::from(FINE)).exp());
    best(&mut fine.into_iter()).map(|(interval, _)| interval)
}

/// What the sum of squares of residuals falls by with waves of another interval, beside an offset and the waves that are
/// estimated. Rows: distance, residual, standard deviation.
fn statistic(rows: &[[f64; 3]], given: f64, interval: f64) -> f64 {
    let mut normal = SMatrix::<f64, 9, 9>::zeros();
    let mut right = SVector::<f64, 9>::zeros();
    for [distance, residual, sigma] in rows {
        let wave = |interval: f64, order: f64| (order * std::f64::consts::TAU * distance / interval).sin_cos();
        let [(s2, c2), (s4, c4)] = [2.0, 4.0].map(|order| wave(given, order));
        let [(t2, d2), (t4, d4)] = [2.0, 4.0].map(|order| wave(interval, order));
        let row = SVector::from([1.0, s2, c2, s4, c4, t2, d2, t4, d4]);
        let weight = sigma.powi(-2);
        normal += weight * row * row.transpose();
        right += weight * residual * row;
    }
    let mean = normal.trace() / 9.0;
    (0..9).for_each(|i| normal[(i, i)] += 1e-6 * mean);
    normal.cholesky().map_or(f64::NAN, |factor| right.dot(&factor.solve(&right)))
}
