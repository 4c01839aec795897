//! Pairs of parameters that networks of range cameras hardly separate.

use serde::Serialize;

use crate::calibrate::CorrelationSummary;

/// The pairs, and what separates them.
const NOTORIOUS: [(&str, &str, &str); 12] = [
    ("xp", "p1", "cameras rolled by 90 degrees about the viewing axis"),
    ("yp", "p2", "cameras rolled by 90 degrees about the viewing axis"),
    ("xp", "e1", "targets at different ranges in each half of the image"),
    ("yp", "e2", "targets at different ranges in each half of the image"),
    ("c", "d0", "a known distance, or targets at different depths"),
    ("c", "k1", "targets out to the corners of the image"),
    ("k1", "k2", "targets out to the corners of the image"),
    ("k2", "k3", "targets out to the corners of the image; or hold k3"),
    ("k1", "k3", "targets out to the corners of the image; or hold k3"),
    ("d0", "d2", "ranges over a whole ambiguity interval, or a known distance"),
    ("d0", "d3", "ranges over a whole ambiguity interval, or a known distance"),
    ("d2", "d3", "ranges over a whole ambiguity interval"),
];

/// Two estimated parameters that are known to be hard to separate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NotoriousPair {
    /// The one, with its integration time where there are several.
    pub first: String,
    /// The other.
    pub second: String,
    /// Their correlation.
    pub correlation: f64,
    /// What separates them.
    pub separated_by: &'static str,
}

/// Whether two parameters are such a pair, whatever integration times they belong to.
pub(crate) fn is_notorious(a: &str, b: &str) -> bool {
    let ((a, _), (b, _)) = (parts(a), parts(b));
    NOTORIOUS.iter().any(|(p, q, _)| (*p == a && *q == b) || (*p == b && *q == a))
}

/// Name and integration time (`d0@0.004`).
fn parts(name: &str) -> (&str, Option<&str>) {
    name.split_once('@').map_or((name, None), |(name, time)| (name, Some(time)))
}

/// The pairs that are both estimated: of range terms, those of the same integration time.
pub(crate) fn notorious_pairs(correlation: &CorrelationSummary) -> Vec<NotoriousPair> {
    let names = || correlation.names.iter().enumerate();
    let mut pairs = Vec::new();
    for (first, second, separated_by) in NOTORIOUS {
        for (i, a) in names().filter(|(_, name)| parts(name).0 == first) {
            for (j, b) in names().filter(|(_, name)| parts(name).0 == second) {
                let camera =
                    |name: &str| range_io::calibration::Calibration::CAMERA_PARAMETERS.iter().any(|(n, _)| *n == name);
                let same_time = parts(a).1 == parts(b).1 || camera(first) || camera(second);
                if let Some(value) = correlation.matrix.get(i).and_then(|row| row.get(j)).filter(|_| same_time) {
                    let (first, second) = (a.clone(), b.clone());
                    pairs.push(NotoriousPair { first, second, correlation: *value, separated_by });
                }
            }
        }
    }
    pairs
}
