//! Shorter steps where rounds undo each other.

use nalgebra::DVector;

/// Steps that turn back are shortened by Aitken's rule [Irons1969]: where a step changes the weights of points, or which of
/// them count, so that the next one undoes it, stations would go to and fro for ever with the solution between.
#[derive(Debug, Default)]
pub(crate) struct Relaxation {
    /// The part of the last step that was taken, and that step whole.
    last: Option<(f64, DVector<f64>)>,
}

impl Relaxation {
    /// The part of this step to be taken, at most all of it.
    pub(crate) fn share(&mut self, step: DVector<f64>) -> f64 {
        let share = self.last.as_ref().map_or(1.0, |(share, last)| {
            let change = last - &step;
            let share = share * last.dot(&change) / change.norm_squared();
            // A step that grows, or stays, has not turned back.
            if share > 0.0 { share.min(1.0) } else { 1.0 }
        });
        self.last = Some((share, step));
        share
    }
}

#[cfg(test)]
#[path = "../../tests/inside/relaxation.rs"]
mod tests;
