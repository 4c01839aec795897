//! From the source to the one who works: through a slot in which the newest frame wins, or frame by frame.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, OnceLock};
use std::thread::JoinHandle;
use std::time::Duration;

use live_frames::{FrameReader, FrameWriter, latest_frame};

use crate::sources::{FrameSource, Next};
use crate::wire::{FrameError, LiveFrame};

/// What comes next.
pub(super) enum Arrival {
    Frame(LiveFrame),
    /// Nothing within the time.
    Nothing,
    /// The source has ended, or cannot be read further.
    End(Result<(), FrameError>),
}

/// Frames that can't be read: their number, and what is wrong with the first.
#[derive(Debug, Default)]
pub(super) struct Unreadable {
    count: AtomicU64,
    first: OnceLock<String>,
}

impl Unreadable {
    fn add(&self, words: String) {
        self.first.get_or_init(|| words);
        self.count.fetch_add(1, Ordering::Release);
    }

    pub(super) fn get(&self) -> Option<(u64, &str)> {
        let count = self.count.load(Ordering::Acquire);
        self.first.get().filter(|_| count > 0).map(|first| (count, first.as_str()))
    }
}

/// Frames on their way.
pub(super) struct Feed {
    way: Way,
    unreadable: Arc<Unreadable>,
}

enum Way {
    /// Each frame is waited for; none is dropped.
    Direct { source: Box<dyn FrameSource>, spare: Option<LiveFrame> },
    /// A thread reads, and drops what is not taken in time.
    Slot {
        reader: FrameReader<LiveFrame>,
        back: Sender<LiveFrame>,
        stop: Arc<AtomicBool>,
        thread: Option<JoinHandle<Result<(), FrameError>>>,
    },
}

impl Feed {
    pub(super) fn new(source: Box<dyn FrameSource>, every_frame: bool) -> Self {
        let unreadable = Arc::new(Unreadable::default());
        let way = if every_frame { Way::Direct { source, spare: None } } else { slot(source, &unreadable) };
        Self { way, unreadable }
    }

    /// The next frame, waited for no longer than this where a thread reads.
    pub(super) fn next(&mut self, timeout: Duration) -> Arrival {
        match &mut self.way {
            Way::Direct { source, spare } => match source.next(spare.take()) {
                Ok(Next::Frame(frame)) => Arrival::Frame(frame),
                Ok(Next::Unreadable(words)) => {
                    self.unreadable.add(words);
                    Arrival::Nothing
                }
                Ok(Next::Waiting) => Arrival::Nothing,
                Ok(Next::End) => Arrival::End(Ok(())),
                Err(error) => Arrival::End(Err(error)),
            },
            Way::Slot { reader, thread, .. } => match reader.read_within(timeout) {
                Some(frame) => Arrival::Frame(frame),
                // The writer may have put a last frame there before it went.
                None if reader.is_closed() => match reader.try_read() {
                    Some(frame) => Arrival::Frame(frame),
                    None => Arrival::End(ended(thread.take())),
                },
                None => Arrival::Nothing,
            },
        }
    }

    /// Gives a frame back, so that its memory can be used again.
    pub(super) fn give_back(&mut self, frame: LiveFrame) {
        match &mut self.way {
            Way::Direct { spare, .. } => *spare = Some(frame),
            // A thread that has ended needs none.
            Way::Slot { back, .. } => drop(back.send(frame)),
        }
    }

    /// Frames that nobody took in time.
    pub(super) fn dropped(&self) -> u64 {
        match &self.way {
            Way::Direct { .. } => 0,
            Way::Slot { reader, .. } => reader.dropped(),
        }
    }

    pub(super) fn unreadable(&self) -> &Unreadable {
        &self.unreadable
    }
}

impl Drop for Feed {
    /// A thread that waits for a pipe sees this with the next frame; nobody waits for it.
    fn drop(&mut self) {
        if let Way::Slot { stop, .. } = &self.way {
            stop.store(true, Ordering::Relaxed);
        }
    }
}

fn slot(source: Box<dyn FrameSource>, unreadable: &Arc<Unreadable>) -> Way {
    let (writer, reader) = latest_frame();
    let (back, used) = channel();
    let stop = Arc::new(AtomicBool::new(false));
    let (unreadable, stopped) = (Arc::clone(unreadable), Arc::clone(&stop));
    let thread = std::thread::spawn(move || read(source, writer, &used, &unreadable, &stopped));
    Way::Slot { reader, back, stop, thread: Some(thread) }
}

/// Reads until the source ends: three frames are in memory at a time, of which one is in the slot and one is worked on.
fn read(
    mut source: Box<dyn FrameSource>,
    mut writer: FrameWriter<LiveFrame>,
    used: &Receiver<LiveFrame>,
    unreadable: &Unreadable,
    stop: &AtomicBool,
) -> Result<(), FrameError> {
    let mut spare: Option<LiveFrame> = None;
    while !stop.load(Ordering::Relaxed) {
        match source.next(spare.take().or_else(|| used.try_recv().ok()))? {
            Next::Frame(frame) => spare = writer.write(frame),
            Next::Unreadable(words) => unreadable.add(words),
            Next::Waiting => {}
            Next::End => break,
        }
    }
    Ok(())
}

fn ended(thread: Option<JoinHandle<Result<(), FrameError>>>) -> Result<(), FrameError> {
    match thread.map(JoinHandle::join) {
        Some(Ok(ended)) => ended,
        // What a reader of somebody else panicked with went to standard error; the frames before are good.
        Some(Err(_)) => {
            Err(FrameError::Read { position: 0, source: std::io::Error::other("the thread that reads has failed") })
        }
        None => Ok(()),
    }
}
