//! Unwrapping without amplitudes.

use phase_unwrap::{KnownWraps, SpatialOptions, Unwrapped, Unwrapper};

use crate::measure::report;
use crate::{Outcome, Size, files};

/// The plain tree, as for every frame of a stream: buffers are made once.
pub fn tree(size: Size, folder: &str) -> Outcome {
    let phase = files::read(folder, "phase.f32", size)?;
    let mut unwrapper = Unwrapper::new(SpatialOptions::default())?;
    let mut found = Unwrapped::default();
    let work = || unwrapper.unwrap_into(&phase, None, None, KnownWraps::Nothing, &mut found);
    report("tree", phase.len(), work)?;
    files::write_counts(folder, "ours_tree.i32", &found.wraps)
}

/// What stands up to noise of a radian.
pub fn noisy(size: Size, folder: &str) -> Outcome {
    let phase = files::read(folder, "phase.f32", size)?;
    let mut unwrapper = Unwrapper::new(SpatialOptions::default())?;
    let mut found = Unwrapped::default();
    let work = || unwrapper.unwrap_into(&phase, None, None, KnownWraps::Nothing, &mut found);
    report("noisy", phase.len(), work)?;
    files::write_counts(folder, "ours_noisy.i32", &found.wraps)
}
