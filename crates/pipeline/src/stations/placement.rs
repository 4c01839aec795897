//! Stations that are probably in the wrong place, in words.

use multiview_registration::{StationPlacement, UncheckedPair};

use commands::{Doubt, DoubtKind};

/// What to say of a station that is probably in the wrong place.
pub fn wrong_place(name: &str, found: &StationPlacement) -> Doubt {
    let words = format!(
        "{:.0} % of what it and the other stations see in common contradicts, {:.0} times what is usual between \
         the others: it is probably in the wrong place. Give start poses, or leave it out",
        100.0 * found.share(),
        found.times_usual.unwrap_or(f64::NAN)
    );
    Doubt::about(DoubtKind::Placement, name, words)
}

/// What to say of a station that does not belong to the others.
pub fn not_placed(name: &str, reason: &str) -> Doubt {
    Doubt::about(DoubtKind::Placement, name, format!("not placed, and not in the results: {reason}"))
}

/// What to say of a pair that alone joins stations with the others.
pub fn unchecked(pair: &UncheckedPair, name: impl Fn(usize) -> String) -> Doubt {
    let names: Vec<String> = pair.frames.iter().map(|&frame| name(frame)).collect();
    let words = format!(
        "nothing but this pair says where {} stands: if it is wrong, nothing shows it. Another station that shares \
         surfaces with both sides is needed",
        names.join(", ")
    );
    Doubt::about(DoubtKind::Alignment, format!("{} onto {}", name(pair.source), name(pair.target)), words)
}
