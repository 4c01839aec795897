//! What goes wrong with the tables of a network, each done to a sound one.

mod control;
mod pick;
mod stations;
mod tables;
mod terms;
mod values;

use self_calibration::{CauseKind, Network, NetworkDatum};

use super::networks::Sound;

/// What the calibration of a broken network should say.
#[derive(Debug, Clone, PartialEq)]
pub enum Expected {
    /// The result stands, these values are rejected: station and targets.
    Rejected(String, Vec<String>),
    /// It is refused, with this cause, of this station or of all.
    Refused(Vec<CauseKind>, Option<String>),
    /// Refused or given with a doubt, with a cause of one of these kinds that has all these names.
    Told(Vec<CauseKind>, Vec<String>),
    /// The given values of these targets or stations are rejected, and of no others; or a cause has exactly these names.
    Control(Vec<String>),
    /// It is refused without a cause: nothing known explains it.
    Unexplained,
    /// It is refused before anything is computed.
    OutsideImage,
    /// The result stands: what is wrong does not enter it.
    Unharmed,
}

/// Networks that a fault can be done to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum On {
    /// Any network.
    Any,
    /// Those with control targets.
    Control,
    /// Those with stations whose poses are known.
    Stations,
}

/// A fault: name and what it does, with a number that chooses station and rows.
pub struct Fault {
    pub name: &'static str,
    pub on: On,
    /// Terms that are not estimated.
    pub without: &'static [&'static str],
    pub spoil: fn(&mut Network, usize) -> Expected,
}

impl Fault {
    fn new(name: &'static str, spoil: fn(&mut Network, usize) -> Expected) -> Self {
        Self { name, on: On::Any, without: &[], spoil }
    }

    fn on(self, on: On) -> Self {
        Self { on, ..self }
    }

    /// Whether it is tried on a network of another method or with automatic terms as well.
    pub fn is_for(&self, sound: &Sound) -> bool {
        let typical = [
            "range one interval too long",
            "two names exchanged",
            "ranges of a station in millimetres",
            "targets of a station shifted by one row",
            "rows of a station flipped",
            "a copy of a station",
            "rows flipped",
            "all ranges in millimetres",
            "depths for all ranges",
            "ranges by another frequency, 20 for 30 MHz",
            "sigmas of ranges in another unit",
        ];
        let control = ["control point 30 mm off", "two control points exchanged"];
        let terms = ["no radial lens terms", "no waves of the ranges"];
        typical.contains(&self.name)
            || control.contains(&self.name) && sound.datum == NetworkDatum::Control
            || terms.contains(&self.name) && !sound.auto
    }
}

/// Every fault of the suite; those of single values and of single stations first.
pub fn all() -> Vec<Fault> {
    let parts = [values::all(), stations::all(), control::all(), tables::all(), terms::all()];
    parts.into_iter().flatten().collect()
}
