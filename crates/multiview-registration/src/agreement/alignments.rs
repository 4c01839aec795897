//! Pairs of stations by themselves, and which of them to look at.

use std::collections::BTreeSet;

use icp_registration::IcpResult;

/// Two stations brought together.
#[derive(Debug, Clone, PartialEq)]
pub struct PairAlignment {
    /// Index of the target station.
    pub target: usize,
    /// Index of the source station.
    pub source: usize,
    /// The alignment.
    pub result: IcpResult,
}

/// Two stations that overlap and could not be aligned.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RefusedPair {
    /// Index of the target station.
    pub target: usize,
    /// Index of the source station.
    pub source: usize,
    /// Why.
    pub reason: String,
}

/// How much of one station another one has seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Overlap {
    /// Index of the station whose surfaces are looked for.
    pub source: usize,
    /// Index of the station in which they are looked for; smaller than `source`.
    pub target: usize,
    /// Fraction of the source's surfaces that the target has seen.
    pub fraction: f64,
}

/// Pairs of target and source that are among the best partners of either, in ascending order.
pub(crate) fn best_partners(
    overlaps: &[Overlap],
    stations: usize,
    minimum_overlap: f64,
    partners_per_station: usize,
) -> Vec<(usize, usize)> {
    let enough: Vec<&Overlap> = overlaps.iter().filter(|o| o.fraction >= minimum_overlap).collect();
    let mut of_station: Vec<Vec<&Overlap>> = vec![Vec::new(); stations];
    for overlap in enough {
        of_station[overlap.target].push(overlap);
        of_station[overlap.source].push(overlap);
    }
    let mut chosen = BTreeSet::new();
    for mut partners in of_station {
        // Stable: equal overlaps stay in the order of the stations.
        partners.sort_by(|a, b| b.fraction.total_cmp(&a.fraction));
        chosen.extend(partners.iter().take(partners_per_station).map(|o| (o.target, o.source)));
    }
    chosen.into_iter().collect()
}
