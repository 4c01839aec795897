//! What would explain single rejected values: a whole interval, another unit, two names exchanged.

use std::collections::BTreeMap;

use crate::{CalibrationOutcome, Component, Network, ObservationQuality, Verdict};

/// Standard deviations, times sigma0, that an explained value may be off by: one in 15,000 sound values is more.
const FITS: f64 = 4.0;

/// One sentence for each rejected value that something explains, in the order of the residuals.
pub(crate) fn sentences(outcome: &CalibrationOutcome, network: &Network) -> Vec<String> {
    let rejected = |quality: &&ObservationQuality| quality.verdict == Verdict::Rejected;
    let tolerance = FITS * outcome.sigma0.unwrap_or(1.0).max(1.0);
    let ranges = outcome.residuals.iter().filter(rejected).filter(|quality| quality.component == Component::Range);
    let interval = network.range_model.ambiguity_interval_m;
    let mut out: Vec<String> = ranges.filter_map(|range| of_range(range, interval, tolerance)).collect();
    out.extend(exchanged(outcome, tolerance));
    out
}

fn of_range(range: &ObservationQuality, interval: f64, tolerance: f64) -> Option<String> {
    let near = |value: f64| value.abs() <= tolerance * range.sigma;
    let what = || format!("the range of target `{}` from station `{}`", range.target, range.station);
    let count = (range.residual / interval).round();
    // The shorter waves of the range error are the same a whole interval farther.
    if count.is_finite() && count.abs() >= 1.0 && near(range.residual - count * interval) {
        let way = if count > 0.0 { "long" } else { "short" };
        let many = if count.abs() > 1.0 {
            format!("{} ambiguity intervals", count.abs())
        } else {
            "one ambiguity interval".to_owned()
        };
        return Some(format!("{} was rejected: it is {many} too {way}", what()));
    }
    let predicted = range.observed - range.residual;
    let unit = [("millimetres", 1e3), ("centimetres", 1e2)];
    // What periodic terms make of a range a thousand times too long is not known: two percent are near enough.
    let found = unit.into_iter().find(|(_, factor)| (range.observed / factor - predicted).abs() <= 0.02 * predicted);
    found.map(|(unit, _)| format!("{} was rejected: it seems to be in {unit}", what()))
}

/// Pairs of image points of a station that fit with their names exchanged.
fn exchanged(outcome: &CalibrationOutcome, tolerance: f64) -> Vec<String> {
    let mut points: BTreeMap<(&str, &str), [Option<&ObservationQuality>; 2]> = BTreeMap::new();
    for quality in outcome.residuals.iter().filter(|quality| quality.verdict == Verdict::Rejected) {
        let axis = match quality.component {
            Component::Col => 0,
            Component::Row => 1,
            _ => continue,
        };
        points.entry((quality.station.as_str(), quality.target.as_str())).or_default()[axis] = Some(quality);
    }
    let points: Vec<(&str, &str, [&ObservationQuality; 2])> = points
        .into_iter()
        .filter_map(|((station, target), [col, row])| Some((station, target, [col?, row?])))
        .collect();
    let fits = |seen: &[&ObservationQuality; 2], other: &[&ObservationQuality; 2]| {
        let pairs = seen.iter().zip(other);
        pairs
            .into_iter()
            .all(|(seen, other)| (seen.observed - (other.observed - other.residual)).abs() <= tolerance * seen.sigma)
    };
    let mut out = Vec::new();
    for (index, (station, target, seen)) in points.iter().enumerate() {
        for (_, other, there) in points[index + 1..].iter().filter(|(name, ..)| name == station) {
            if fits(seen, there) && fits(there, seen) {
                out.push(format!(
                    "the image points of targets `{target}` and `{other}` from station `{station}` were rejected: they fit \
                     with their names exchanged"
                ));
            }
        }
    }
    out
}
