#![allow(dead_code, clippy::print_stderr)]

use std::path::PathBuf;

/// The folder of real captures, `None` (with a word) where it is missing.
pub fn real(relative: &str) -> Option<PathBuf> {
    let path = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/real")).join(relative);
    if path.exists() {
        return Some(path);
    }
    eprintln!("skipped: no real capture {}", path.display());
    None
}

/// Few cases, and nothing written beside the tests.
pub fn cases(cases: u32) -> proptest::test_runner::Config {
    proptest::test_runner::Config { cases, failure_persistence: None, ..Default::default() }
}
