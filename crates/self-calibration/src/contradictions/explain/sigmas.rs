//! Standard deviations of control or distances in another unit.

use crate::contradictions::suspicion::unit_factor;
use crate::findings::contradiction::{Cause, CauseKind};
use crate::{CalibrationOutcome, GroupQuality};

/// Redundancy from which on the scale of a group is believed: its own relative deviation is then 0.13.
const ENOUGH: f64 = 30.0;

/// Groups that scatter a thousand times as much as stated, or a thousandth. Those of the sightings are no result at all.
pub(super) fn units(outcome: &CalibrationOutcome) -> Vec<Cause> {
    let of_sightings = |group: &&GroupQuality| ["col", "row", "range"].contains(&group.name.as_str());
    let own = outcome.groups.iter().filter(|group| group.redundancy >= ENOUGH && !of_sightings(group));
    own.filter_map(|group: &GroupQuality| {
        let scale = group.sigma0?;
        let way = if unit_factor(scale)? > 1.0 { "small" } else { "large" };
        Some(Cause {
            kind: CauseKind::SigmaUnit,
            station: None,
            names: vec![group.name.clone()],
            words: format!(
                "{} scatters {scale:.1e} times as much as stated: its standard deviations are a thousand times too {way}, as \
                 in another unit",
                group.name
            ),
            remedy: "mend its standard deviations",
            log_odds: group.redundancy * scale.ln().abs(),
        })
    })
    .collect()
}
