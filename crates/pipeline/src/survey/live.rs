use std::sync::Arc;

/// How many frames that were read of a survey are still in memory: each view holds one of these.
#[derive(Debug, Clone, Default)]
pub struct LiveFrames(Arc<()>);

impl LiveFrames {
    /// Frames in memory, if the survey holds one of these and each view another.
    pub fn count(&self) -> usize {
        Arc::strong_count(&self.0) - 1
    }
}
