//! Preintegration and sequences on simulated motions. Measured figures are shown with `--show-output`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stderr)]

mod path;
mod preintegration;
#[cfg(feature = "sequence")]
mod sequence;
mod state;
