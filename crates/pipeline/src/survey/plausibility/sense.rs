//! Whether the phase runs the wrong way, told by the amplitudes: see [`stored_values::SenseVotes`].

use crate::survey::view::{View, ViewData};
use commands::{Doubt, DoubtKind, Tape};

/// What the windows of the views looked at say.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SenseVotes(stored_values::SenseVotes);

impl SenseVotes {
    /// Lets the windows of a view at level `phase` vote.
    pub fn look_at(&mut self, view: &View) {
        if let ViewData::Phase(frame) = &view.data {
            self.0.look_at(frame);
        }
    }

    /// Writes it, or adds what another part of the survey says.
    pub(crate) fn carry(&mut self, tape: &mut Tape) {
        for count in self.0.windows() {
            tape.count(count);
        }
    }

    /// How they voted; `None` where no window could.
    pub fn in_words(&self) -> Option<String> {
        self.0.in_words()
    }

    /// Whether they are sure of the wrong sense.
    pub fn doubt(&self) -> Option<Doubt> {
        let cure =
            "the phase runs the other way. Turn camera.phase_sense in survey.ron, or name the steps in their order";
        self.0.reversed().map(|seen| Doubt::new(DoubtKind::PhaseSense, format!("{seen}: {cure}")))
    }
}
