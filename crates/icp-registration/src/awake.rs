//! A second thread that does not fall asleep between short pieces of work.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Without work for so long, the second thread goes its way: pieces follow each other faster.
const PATIENCE: Duration = Duration::from_micros(200);

/// Does `work`, whose parallel pieces take tens of microseconds each, with one more thread of the pool awake until it ends.
///
/// A thread that finds nothing to do for some ten microseconds is put to sleep, and waking it takes as long as a piece of
/// work: registrations on two threads were 1.4 to 1.5 times as fast as on one. This one looks for work all the time. What
/// comes out does not depend on it, and where all threads are busy it does nothing.
pub(crate) fn with_thread_awake<R: Send>(work: impl FnOnce() -> R + Send) -> R {
    let Some(owner) = rayon::current_thread_index().filter(|_| rayon::current_num_threads() > 1) else { return work() };
    let done = AtomicBool::new(false);
    rayon::in_place_scope(|scope| {
        scope.spawn(|_| {
            // The owner has work of its own.
            if rayon::current_thread_index() != Some(owner) {
                look_for_work(&done);
            }
        });
        let result = work();
        done.store(true, Ordering::Relaxed);
        result
    })
}

fn look_for_work(done: &AtomicBool) {
    let mut last = Instant::now();
    while !done.load(Ordering::Relaxed) && last.elapsed() < PATIENCE {
        if rayon::yield_now() == Some(rayon::Yield::Executed) {
            last = Instant::now();
        }
        std::hint::spin_loop();
    }
}
