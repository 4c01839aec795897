use phase_unwrap::Error;

/// When counts are carried and when they are solved anew.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CarryOptions {
    /// Every so many frames the tree solves the whole frame, knowing nothing of those before: no wrong count lives longer.
    /// 1: every frame. Default: 150, five seconds at 30 Hz; such a frame costs several times as much as the others, and these
    /// are then fewer than one in a hundred.
    pub refresh_frames: u32,
    /// Share of the used pixels that may fail their check; beyond it the tree solves the whole frame. Default: 0.25. Smaller,
    /// and swift motion costs whole trees; larger, and more of a frame rests on what is left of the one before.
    pub most_failed: f32,
    /// Every so many frames the counts are held against those of a small image of the frame, which the tree solves knowing
    /// nothing of the frames before; more often where pixels are left without a count, or neighbours that look like one surface
    /// differ in theirs. 1: in every frame. Default: 3, a tenth
    /// of a second at 30 Hz.
    pub check_frames: u32,
}

impl Default for CarryOptions {
    fn default() -> Self {
        Self { refresh_frames: 150, most_failed: 0.25, check_frames: 3 }
    }
}

impl CarryOptions {
    pub(crate) fn validate(&self) -> Result<(), Error> {
        for (name, frames) in [("refresh_frames", self.refresh_frames), ("check_frames", self.check_frames)] {
            if frames == 0 {
                return Err(Error::OutOfDomain { name, value: 0.0, expected: "at least 1" });
            }
        }
        if !(0.0..=1.0).contains(&self.most_failed) {
            let value = self.most_failed.into();
            return Err(Error::OutOfDomain { name: "most_failed", value, expected: "a share from 0 to 1" });
        }
        Ok(())
    }
}

/// Why the tree solved a whole frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum WholeFrame {
    /// There was no frame before, or it was forgotten.
    First,
    /// It was the turn of [`CarryOptions::refresh_frames`].
    Refresh,
    /// More pixels than [`CarryOptions::most_failed`] did not hold.
    Failed,
}

/// Where the counts of a frame came from.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CarrySummary {
    /// Why the tree solved the whole frame; `None` where counts were carried. The figures below are of the carrying then.
    pub whole: Option<WholeFrame>,
    /// Pixels with a phase.
    pub used: usize,
    /// Pixels whose check did not hold.
    pub failed: usize,
    /// Those of them that a neighbour on the same surface gave its count.
    pub attached: usize,
    /// Whether the counts were held against those of a small image.
    pub checked: bool,
    /// Pixels that took its count where it is not sure of it, or shows another surface than they do; their confidence is 0 until the
    /// next check agrees.
    pub doubted: usize,
    /// Pixels that took its count because it contradicted theirs.
    pub mended: usize,
    /// Pixels whose count is a guess for this frame, from a neighbour: at edges, and where none is on the same surface. Their
    /// confidence is 0.
    pub guessed: usize,
}
