//! Stations that are probably in the wrong place, in words.

use multiview_registration::StationPlacement;

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
