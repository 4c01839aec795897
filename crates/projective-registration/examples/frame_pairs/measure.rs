//! CPU time of what runs on this thread.

#[path = "../../../../xtask/peers/cpu_clock.rs"]
mod cpu_clock;

use cpu_clock::cpu_seconds;

/// The result of `work` and its CPU time in milliseconds.
pub fn measured<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let start = cpu_seconds();
    let result = work();
    (result, 1e3 * (cpu_seconds() - start))
}
