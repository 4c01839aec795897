//! The stream in a browser, on this machine alone.

mod message;
mod path;
mod server;

use std::io;
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use live_frames::ProcessedFrame;
use path::PathLine;

/// Longest wait for a frame that was asked for.
const WAIT: Duration = Duration::from_millis(500);
/// Connections at a time: a browser opens six, and a few more hurt nobody.
const MOST_CONNECTIONS: usize = 16;

/// A page at an address of this machine that shows range, amplitude, flags and points of the newest frame.
///
/// The one who works on frames offers each; a copy is made only where somebody asked for one since the last.
#[derive(Debug)]
pub struct LiveView {
    shared: Arc<Shared>,
    address: SocketAddr,
    path: PathLine,
}

/// What the threads of the page and the one who works on frames share.
#[derive(Debug, Default)]
struct Shared {
    /// Somebody waits for a newer copy.
    wanted: AtomicBool,
    copy: Mutex<Copied>,
    copied: Condvar,
    connections: AtomicUsize,
    stopped: AtomicBool,
}

/// The copy that pages are shown.
#[derive(Debug, Default)]
struct Copied {
    /// Counts copies.
    number: u64,
    frame: Vec<u8>,
    status: String,
}

impl LiveView {
    /// Listens at a port of the loopback; 0: any that is free. `vertical_axis`: index of the axis of the world that points up, which
    /// paths are drawn along.
    ///
    /// # Errors
    /// What the system says, such as that the port is taken.
    pub fn new(port: u16, vertical_axis: usize) -> io::Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
        let address = listener.local_addr()?;
        let shared = Arc::new(Shared::default());
        let own = Arc::clone(&shared);
        std::thread::Builder::new().name("page".to_owned()).spawn(move || serve(&listener, &own))?;
        Ok(Self { shared, address, path: PathLine::new(vertical_axis) })
    }

    /// Where the page is.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Copies a frame, and the status as JSON, for the page, where somebody asked. It never waits.
    pub fn offer(&mut self, frame: &ProcessedFrame, status: &dyn Fn() -> String) {
        self.path.follow(frame);
        if !self.shared.wanted.load(Ordering::Acquire) {
            return;
        }
        let Ok(mut copy) = self.shared.copy.try_lock() else { return };
        self.shared.wanted.store(false, Ordering::Release);
        copy.number += 1;
        message::write(frame, &mut copy.frame);
        self.path.write(frame, &mut copy.frame);
        copy.status = status();
        drop(copy);
        self.shared.copied.notify_all();
    }
}

impl Drop for LiveView {
    fn drop(&mut self) {
        self.shared.stopped.store(true, Ordering::Release);
        // The thread waits for a connection: here is one.
        drop(TcpStream::connect(self.address));
    }
}

impl Shared {
    fn copy(&self) -> MutexGuard<'_, Copied> {
        self.copy.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A copy that is newer than this request, or the last one where none comes in time.
    fn newest(&self) -> MutexGuard<'_, Copied> {
        let copy = self.copy();
        let before = copy.number;
        self.wanted.store(true, Ordering::Release);
        let waited = self.copied.wait_timeout_while(copy, WAIT, |copy| copy.number == before);
        waited.unwrap_or_else(PoisonError::into_inner).0
    }
}

fn serve(listener: &TcpListener, shared: &Arc<Shared>) {
    for connection in listener.incoming() {
        if shared.stopped.load(Ordering::Acquire) {
            return;
        }
        let Ok(connection) = connection else { continue };
        if shared.connections.fetch_add(1, Ordering::AcqRel) >= MOST_CONNECTIONS {
            shared.connections.fetch_sub(1, Ordering::AcqRel);
            continue;
        }
        let own = Arc::clone(shared);
        let answer = move || {
            // Who has closed the connection wants no answer.
            let _ = server::answer(connection, &own);
            own.connections.fetch_sub(1, Ordering::AcqRel);
        };
        if std::thread::Builder::new().spawn(answer).is_err() {
            shared.connections.fetch_sub(1, Ordering::AcqRel);
        }
    }
}
