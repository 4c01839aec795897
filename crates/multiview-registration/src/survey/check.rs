//! Pairs of stations by themselves at the adjusted poses: how loops close, and which pairs contradict them.

use crate::adjustment::rounds::FEWEST_CONTACTS;
use crate::adjustment::simultaneous::Adjusted;
use crate::agreement::alignments::{PairAlignment, RefusedPair, best_partners};
use crate::agreement::loops::{LoopClosure, contradicting, spanning_tree};
use crate::error::Result;
use crate::survey::datum::Datum;

/// Partners that each station is held against by itself, those with the most overlap.
const PARTNERS: usize = 3;
/// How far a loop of pairs may fail to close before one of them counts as wrong, in radii of the clouds: far above the
/// error of a right pair and far below that of a wrong one.
const LOOP_TOLERANCE: f64 = 0.1;

/// Pairs at the adjusted poses.
pub(crate) struct Checked {
    pub pairs: Vec<PairAlignment>,
    pub refused: Vec<RefusedPair>,
    pub loops: Vec<LoopClosure>,
}

/// The pairs with the most overlap by themselves, and how their loops close.
pub(crate) fn checked(
    adjusted: &Adjusted,
    minimum_overlap: f64,
    datum: Datum,
    (radius_m, size_m): (f64, f64),
) -> Result<Checked> {
    let count = adjusted.state.poses.len();
    let overlaps = adjusted.overlaps(FEWEST_CONTACTS);
    let candidates = best_partners(&overlaps, count, minimum_overlap, PARTNERS);
    let pairs = adjusted.pairs(&candidates, radius_m, size_m)?;
    let tolerance_m = LOOP_TOLERANCE * radius_m;
    let held = datum.held_station();
    let closes = |closure: &LoopClosure| closure.translation_m + radius_m * closure.rotation_rad <= tolerance_m;
    let spanning_tree = spanning_tree(&pairs, (held, adjusted.state.poses[held]), count, &closes);
    let (sound, wrong): (Vec<_>, Vec<_>) = pairs.into_iter().zip(spanning_tree.sound).partition(|(_, sound)| *sound);
    let refused = wrong.iter().map(|(pair, _)| contradicting(pair)).collect();
    Ok(Checked { pairs: sound.into_iter().map(|(pair, _)| pair).collect(), refused, loops: spanning_tree.loops })
}
