//! CPU time of this thread, as Linux tells it.

use std::fs;
use std::time::Duration;

/// CPU seconds of this thread; NaN where the system does not tell.
fn cpu_seconds() -> f64 {
    let figures = || {
        let text = fs::read_to_string("/proc/thread-self/schedstat").ok()?;
        let mut words = text.split_whitespace().map(str::parse::<f64>);
        Some((words.next()?.ok()?, words.nth(1)?.ok()?))
    };
    let Some((_, turns)) = figures() else { return f64::NAN };
    // The system counts up to the last change of threads: sleep until there was one.
    loop {
        std::thread::sleep(Duration::from_micros(50));
        match figures() {
            Some((nanoseconds, now)) if now > turns => return 1e-9 * nanoseconds,
            Some(_) => {}
            None => return f64::NAN,
        }
    }
}

/// The result of `work` and its CPU time in milliseconds.
pub fn measured<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let start = cpu_seconds();
    let result = work();
    (result, 1e3 * (cpu_seconds() - start))
}
