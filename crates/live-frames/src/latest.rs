//! A slot between two threads that holds the newest frame and no other.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A slot from one writer to one reader: the newest frame wins, and what it replaces is counted as dropped.
///
/// ```
/// let (mut writer, reader) = live_frames::latest_frame();
/// assert_eq!(writer.write(1), None);
/// // The reader was too slow: the older one comes back, so that its memory can be used again.
/// assert_eq!(writer.write(2), Some(1));
/// assert_eq!(reader.try_read(), Some(2));
/// assert_eq!(reader.dropped(), 1);
/// drop(writer);
/// assert_eq!(reader.read(), None);
/// ```
pub fn latest_frame<T>() -> (FrameWriter<T>, FrameReader<T>) {
    let shared = Arc::new(Shared {
        slot: Mutex::new(Slot { frame: None, closed: false }),
        filled: Condvar::new(),
        dropped: AtomicU64::new(0),
    });
    (FrameWriter { shared: Arc::clone(&shared) }, FrameReader { shared })
}

/// The end of the camera's thread.
#[derive(Debug)]
pub struct FrameWriter<T> {
    shared: Arc<Shared<T>>,
}

/// The end of the thread that works on frames.
#[derive(Debug)]
pub struct FrameReader<T> {
    shared: Arc<Shared<T>>,
}

#[derive(Debug)]
struct Shared<T> {
    slot: Mutex<Slot<T>>,
    filled: Condvar,
    dropped: AtomicU64,
}

#[derive(Debug)]
struct Slot<T> {
    frame: Option<T>,
    closed: bool,
}

impl<T> Shared<T> {
    /// A thread that panicked with the slot in its hands left it whole: a frame is moved in one step.
    fn slot(&self) -> MutexGuard<'_, Slot<T>> {
        self.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<T> FrameWriter<T> {
    /// Puts a frame into the slot. The one that it replaces, which nobody read, comes back and counts as dropped. It waits
    /// for nothing but the moment in which the reader takes a frame out.
    pub fn write(&mut self, frame: T) -> Option<T> {
        let older = self.shared.slot().frame.replace(frame);
        self.shared.filled.notify_one();
        if older.is_some() {
            self.shared.dropped.fetch_add(1, Ordering::Relaxed);
        }
        older
    }

    /// Frames that were replaced before they were read.
    pub fn dropped(&self) -> u64 {
        self.shared.dropped.load(Ordering::Relaxed)
    }
}

impl<T> Drop for FrameWriter<T> {
    fn drop(&mut self) {
        self.shared.slot().closed = true;
        self.shared.filled.notify_one();
    }
}

impl<T> FrameReader<T> {
    /// The newest frame, if one has come since the last.
    pub fn try_read(&self) -> Option<T> {
        self.shared.slot().frame.take()
    }

    /// Waits for a frame; `None` once the writer is gone and the slot empty.
    pub fn read(&self) -> Option<T> {
        let mut slot = self.shared.slot();
        loop {
            if slot.frame.is_some() || slot.closed {
                return slot.frame.take();
            }
            slot = self.shared.filled.wait(slot).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Waits for a frame, but no longer than this; `None` as well once the writer is gone.
    pub fn read_within(&self, timeout: Duration) -> Option<T> {
        let waiting = |slot: &mut Slot<T>| slot.frame.is_none() && !slot.closed;
        let waited = self.shared.filled.wait_timeout_while(self.shared.slot(), timeout, waiting);
        waited.unwrap_or_else(PoisonError::into_inner).0.frame.take()
    }

    /// Frames that were replaced before they were read.
    pub fn dropped(&self) -> u64 {
        self.shared.dropped.load(Ordering::Relaxed)
    }

    /// Whether the writer is gone.
    pub fn is_closed(&self) -> bool {
        self.shared.slot().closed
    }
}
