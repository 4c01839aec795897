//! Refusals of a registration in words: stations by their names, what was tried, what it showed, what to do.

use crate::Error;

/// What the registration started from.
#[derive(Debug, Clone, Copy)]
pub enum Tried {
    /// Start poses, right to this distance, metre, where that was stated.
    Poses(Option<f64>),
    /// The order of the stations alone.
    Order,
    /// Every pair of stations.
    AllPairs,
    /// Without start poses all of them at once, then each onto the one before.
    Chain,
}

impl Tried {
    fn words(self) -> String {
        match self {
            Self::Poses(Some(error_m)) => format!("tried: start poses, taken to be right to {error_m} m"),
            Self::Poses(None) => "tried: start poses".to_owned(),
            Self::Order => "tried: each station with the two after it, without start poses".to_owned(),
            Self::AllPairs => "tried: every pair of stations, without start poses".to_owned(),
            Self::Chain => {
                "tried: every pair of stations, then each onto the one before, without start poses".to_owned()
            }
        }
    }

    fn remedy(self) -> &'static str {
        match self {
            Self::Poses(_) => "give better start poses, stations between that see surfaces of both, or leave these out",
            _ => "give start poses, stations between that see surfaces of both, or leave these out",
        }
    }
}

/// The error of a stage, with names for numbers.
pub fn of_stage(stage: &'static str, error: multiview_registration::Error, names: &[String], tried: Tried) -> Error {
    match words(&error, names, tried) {
        Some(words) => Error::stage(stage, "all stations")(words),
        None => Error::stage(stage, "all stations")(error),
    }
}

/// The error of the command, with names for numbers.
pub fn of_command(error: &multiview_registration::Error, names: &[String], tried: Tried) -> Error {
    words(error, names, tried).map_or_else(|| Error::registration("all stations", error), Error::Register)
}

/// What to say of stations that nothing connects; `None` for other errors, which speak for themselves. Stations of one
/// name are told apart by their position.
fn words(error: &multiview_registration::Error, names: &[String], tried: Tried) -> Option<String> {
    let name = |index: usize| match names.get(index) {
        Some(name) if names.iter().filter(|other| *other == name).count() > 1 => {
            format!("{name} (number {})", index + 1)
        }
        Some(name) => name.clone(),
        None => format!("number {}", index + 1),
    };
    let multiview_registration::Error::UnconnectedStations { stations, to, reasons } = error else {
        return None;
    };
    let lost: Vec<String> = stations.iter().map(|&index| name(index)).collect();
    let mut reasons: Vec<String> =
        stations.iter().zip(reasons).map(|(&k, why)| format!("{}: {why}", name(k))).collect();
    reasons.truncate(MOST_REASONS);
    Some(format!(
        "nothing brings {} into the frame of {} ({}; {}); {}",
        lost.join(", "),
        name(*to),
        tried.words(),
        reasons.join("; "),
        tried.remedy()
    ))
}

/// Reasons that a line names.
const MOST_REASONS: usize = 3;
