//! `cargo xtask test`: what must be green.

use crate::shell::{Outcome, cargo};
use crate::suites;
use crate::tidy;

pub(crate) fn run() -> Outcome {
    cargo(&["fmt", "--all", "--check"], &[])?;
    tidy::run()?;
    cargo(&["clippy", "--workspace", "--all-targets", "--all-features", "--", "--deny", "warnings"], &[])?;
    // The tests of `calibration-tasks` and `tasks` hold the small room and the real captures against their bars.
    // Examples are compiled by clippy above; linking them would take a minute.
    suites::run()?;
    // Links of the documentation (cold three minutes) and `cargo xtask alone`, which checks forty packages of their own (six), are
    // part of `cargo xtask nightly`.
    cargo(&["test", "--workspace", "--all-features", "--doc"], &[])
}

/// The documentation of the workspace, in which no link leads nowhere.
pub(crate) fn documentation() -> Outcome {
    cargo(&["doc", "--workspace", "--all-features", "--no-deps"], &[("RUSTDOCFLAGS", "--deny warnings")])
}
