//! The stages, one file each, and what they share.
//!
//! All but the last two work on one frame or one station at a time, so that a survey streams through them: [`Line`] holds
//! them ready and gathers what each finds, a few numbers and doubts. `Register` and `Adjust` need all stations; what they
//! keep of each is in `joining`.

pub(crate) mod average;
pub(crate) mod cloud;
pub(crate) mod deconvolve;
pub(crate) mod demodulate;
pub(crate) mod flag;
pub(crate) mod fuse;
pub(crate) mod joining;
pub(crate) mod line;
pub(crate) mod multipath;
pub(crate) mod ranges;
pub(crate) mod wraps;

use std::collections::BTreeMap;

use range_io::calibration::Calibration;

use crate::Result;
use crate::survey::drift::ViewDrift;
use crate::survey::span::SpanTally;
use crate::survey::view::View;
use commands::{Doubt, Tape};
pub(crate) use line::up_to_error;
pub use line::{Line, Step, Watch};

/// Figures that a stage reports, with units in their names.
pub type Findings = BTreeMap<String, f64>;

/// Whether a calibration has anything that [`Stage::CorrectRange`](crate::Stage::CorrectRange) takes off.
pub fn corrects_ranges(calibration: &Calibration) -> bool {
    !calibration.range_models.is_empty() || calibration.warm_up.is_some()
}

/// A stage that works on each view by itself, ready for a survey; on several at the same time.
pub(crate) trait ViewStage: Send + Sync {
    /// Works on a view, and adds what it finds.
    fn apply(&self, view: &mut View, found: &mut Found) -> Result<()>;

    /// What it found in all of them.
    fn findings(&self, found: &Found) -> Findings {
        found.sums.clone()
    }
}

/// What a stage has found so far.
#[derive(Debug, Default)]
pub(crate) struct Found {
    /// Numbers of pixels, views and the like.
    pub(crate) sums: Findings,
    /// What speaks against views.
    pub(crate) doubts: Vec<Doubt>,
    /// Drifts that were taken off.
    pub(crate) drifts: Vec<ViewDrift>,
    /// Pixels inside and outside the calibration's span.
    pub(crate) span: SpanTally,
}

impl Found {
    /// Writes it, or adds what was found in another part of the survey.
    pub(crate) fn carry(&mut self, tape: &mut Tape) {
        tape.sums(&mut self.sums);
        tape.records(&mut self.doubts);
        tape.list(&mut self.drifts, ViewDrift::default, |tape, drift| drift.carry(tape));
        self.span.carry(tape);
    }

    /// Adds what was found in another view.
    pub(crate) fn join(&mut self, other: Self) {
        for (name, sum) in other.sums {
            *self.sums.entry(name).or_default() += sum;
        }
        self.doubts.extend(other.doubts);
        self.drifts.extend(other.drifts);
        self.span.join(&other.span);
    }

    /// Adds to a number.
    pub(crate) fn add(&mut self, name: &str, count: usize) {
        *self.sums.entry(name.to_owned()).or_default() += count as f64;
    }
}
