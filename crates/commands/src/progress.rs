//! How long work tells how far it is, without knowing who watches.

/// Receives the beginning and the steps of long work. All methods may be called from several threads.
pub trait Progress: Sync {
    /// A piece of work with `steps` steps begins; it ends the one before.
    fn begin(&self, work: &str, steps: usize);
    /// `done` steps of the present work are finished.
    fn advance(&self, done: usize);
    /// So many frames of a survey are in memory just now.
    fn frames_in_memory(&self, _frames: usize) {}
    /// Something a person should know.
    fn say(&self, message: &str);
    /// Nothing more will come.
    fn finish(&self);
}

/// Nobody watches.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Progress for Silent {
    fn begin(&self, _: &str, _: usize) {}
    fn advance(&self, _: usize) {}
    fn say(&self, _: &str) {}
    fn finish(&self) {}
}
