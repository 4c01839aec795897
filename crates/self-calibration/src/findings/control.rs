//! What is told of rejected control.

use std::collections::BTreeMap;

use crate::{CalibrationOutcome, Component, Verdict};

impl CalibrationOutcome {
    /// A sentence for each point or pose of the control that was rejected.
    pub(crate) fn doubts_of_control(&self) -> Vec<String> {
        let mut rejected: BTreeMap<(&str, &str), Vec<[f64; 2]>> = BTreeMap::new();
        for quality in &self.residuals {
            if quality.component == Component::Control && quality.verdict == Verdict::Rejected {
                let of = rejected.entry((quality.station.as_str(), quality.target.as_str())).or_default();
                of.push([quality.residual, quality.sigma]);
            }
        }
        rejected.into_iter().map(|((station, target), parts)| sentence(station, target, &parts)).collect()
    }
}

/// `parts`: residual and standard deviation of each component.
fn sentence(station: &str, target: &str, parts: &[[f64; 2]]) -> String {
    let length = |parts: &[[f64; 2]]| parts.iter().map(|[residual, _]| residual * residual).sum::<f64>().sqrt();
    let deviations = parts.iter().map(|[residual, sigma]| (residual / sigma).abs()).fold(0.0, f64::max);
    let millimetres = 1e3 * length(&parts[..3]);
    if station.is_empty() {
        let [x, y, z] = [0, 1, 2].map(|axis| 1e3 * parts[axis][0]);
        return format!(
            "control point `{target}` was rejected: its coordinates in targets.csv are {millimetres:.1} mm (x {x:+.1}, y {y:+.1}, z \
             {z:+.1}) from where the observations put it, up to {deviations:.1} times their deviations; was it moved, mistyped, \
             or exchanged with another?"
        );
    }
    let degrees = length(&parts[3..]).to_degrees();
    format!(
        "the given pose of station `{station}` was rejected: it is {millimetres:.1} mm and {degrees:.2} degrees from where the \
         observations put it, up to {deviations:.1} times its deviations; mend its row in stations.csv"
    )
}
