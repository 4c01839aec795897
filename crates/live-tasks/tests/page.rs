//! The page in a browser, asked for without one.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::thread::JoinHandle;

use live_tasks::{
    FrameError, FrameSource, LiveFrame, LiveRequest, LiveSource, LiveSummary, LiveTracking, LiveWatch, Next, live_from,
};

use crate::common::World;

/// A camera at a hundred frames a second that runs forth and back over what it recorded until it is told to end.
struct Camera {
    frames: Vec<LiveFrame>,
    number: usize,
    ends: Arc<AtomicBool>,
}

impl FrameSource for Camera {
    fn next(&mut self, _: Option<LiveFrame>) -> Result<Next, FrameError> {
        std::thread::sleep(std::time::Duration::from_millis(10));
        self.number += 1;
        let (last, at) = (self.frames.len() - 1, self.number % (2 * self.frames.len() - 2));
        let mut frame = self.frames[last - last.abs_diff(at)].clone();
        frame.header.timestamp_s = 60.0 + 0.01 * self.number as f64;
        frame.arrived = std::time::Instant::now();
        Ok(if self.ends.load(Ordering::Relaxed) { Next::End } else { Next::Frame(frame) })
    }
}

struct Page(std::sync::mpsc::Sender<SocketAddr>);

impl LiveWatch for Page {
    fn page(&mut self, address: SocketAddr) {
        self.0.send(address).unwrap();
    }
}

/// A stream with a page, until it is told to end.
pub struct Running {
    pub address: SocketAddr,
    ends: Arc<AtomicBool>,
    thread: JoinHandle<LiveSummary>,
}

impl Running {
    pub fn begin(world: &World) -> Self {
        Self::asking(world, None)
    }

    pub fn asking(world: &World, tracking: Option<LiveTracking>) -> Self {
        let ends = Arc::new(AtomicBool::new(false));
        let camera = Camera { frames: world.frames(), number: 0, ends: Arc::clone(&ends) };
        let request =
            LiveRequest { view: Some(0), every_frame: false, tracking, ..world.request(LiveSource::StandardInput) };
        let (page, address) = channel();
        let thread = std::thread::spawn(move || live_from(Box::new(camera), &request, &mut Page(page)).unwrap());
        let running = Self { address: address.recv().unwrap(), ends, thread };
        // Until there is a first frame.
        while !running.get("/frame").0.starts_with("HTTP/1.1 200") {}
        running
    }

    pub fn end(self) -> LiveSummary {
        self.ends.store(true, Ordering::Relaxed);
        self.thread.join().unwrap()
    }

    /// Head and body of the answer to a request.
    pub fn ask(&self, request: &str) -> (String, Vec<u8>) {
        let mut connection = TcpStream::connect(self.address).unwrap();
        let mut answer = Vec::new();
        // Where the other side has closed before it read all, that may be an error here.
        let _ = connection.write_all(request.as_bytes());
        let _ = connection.read_to_end(&mut answer);
        let end = answer.windows(4).position(|bytes| bytes == b"\r\n\r\n").unwrap_or(answer.len());
        let head = String::from_utf8(answer[..end].to_vec()).unwrap();
        (head, answer.get(end + 4..).unwrap_or_default().to_vec())
    }

    fn get(&self, path: &str) -> (String, Vec<u8>) {
        self.ask(&format!("GET {path} HTTP/1.1\r\nHost: {}\r\n\r\n", self.address))
    }
}

#[test]
fn the_page_shows_the_newest_frame_and_the_status() {
    let world = World::new();
    let running = Running::begin(&world);
    assert!(running.address.ip().is_loopback());
    let (head, page) = running.get("/");
    assert!(
        head.starts_with("HTTP/1.1 200 OK") && head.contains("Content-Security-Policy: default-src 'none'"),
        "{head}"
    );
    let page = String::from_utf8(page).unwrap();
    assert!(page.contains("<canvas") && !page.contains("http://") && !page.contains("https://"));

    let mut times = Vec::new();
    for _ in 0..2 {
        let (head, frame) = running.get("/frame");
        assert!(head.starts_with("HTTP/1.1 200 OK"), "{head}");
        let whole = |at: usize| u32::from_le_bytes(frame[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!((&frame[..4], whole(4), whole(8), whole(12)), (b"RCLV".as_slice(), 32, 24, 1));
        assert_eq!(frame.len(), 32 + 32 * 24 * (4 + 4 + 12 + 2) + 4);
        times.push(f64::from_le_bytes(frame[24..32].try_into().unwrap()));
        let middle = 32 + 4 * (12 * 32 + 16);
        let range = f32::from_le_bytes(frame[middle..middle + 4].try_into().unwrap());
        assert!((1.4..2.3).contains(&range), "{range}");
    }
    assert!(times[1] > times[0], "{times:?}");
    let (head, status) = running.get("/status");
    assert!(head.contains("application/json"), "{head}");
    let status = String::from_utf8(status).unwrap();
    assert!(status.contains("\"frames\":") && status.contains("\"p99_ms\":"), "{status}");
    let summary = running.end();
    assert!(summary.frames > 2, "{summary}");
}

#[test]
fn what_is_not_the_page_is_refused() {
    let world = World::new();
    let running = Running::begin(&world);
    let host = running.address;
    for (request, expected) in [
        (format!("GET /other HTTP/1.1\r\nHost: {host}\r\n\r\n"), "404"),
        (format!("GET /../etc/passwd HTTP/1.1\r\nHost: {host}\r\n\r\n"), "404"),
        (format!("POST / HTTP/1.1\r\nHost: {host}\r\n\r\n"), "405"),
        ("GET / HTTP/1.1\r\nHost: localhost\r\n\r\n".to_owned(), "200"),
        ("GET / HTTP/1.1\r\nhost: [::1]:80\r\n\r\n".to_owned(), "200"),
        ("GET / HTTP/1.1\r\n\r\n".to_owned(), "403"),
        ("GET / HTTP/1.1\r\nHost: example.org\r\n\r\n".to_owned(), "403"),
        ("GET / HTTP/1.1\r\nHost: 127.0.0.1.example.org\r\n\r\n".to_owned(), "403"),
        ("GET / HTTP/1.1\r\nHost: localhost:80:80\r\n\r\n".to_owned(), "403"),
        (format!("GET / HTTP/1.1\r\nHost: {host}\r\nHost: example.org\r\n\r\n"), "403"),
        ("\r\n\r\n".to_owned(), "403"),
    ] {
        let (head, _) = running.ask(&request);
        assert!(head.starts_with(&format!("HTTP/1.1 {expected}")), "{request}: {head}");
    }
    // What is no request gets no answer, and the page lives on.
    let (head, _) = running.ask(&"x".repeat(20_000));
    assert!(head.is_empty(), "{head}");
    assert!(running.get("/").0.starts_with("HTTP/1.1 200"));
    running.end();
}

#[test]
fn the_page_gets_pose_and_path() {
    let world = World::moving("");
    let running = Running::asking(&world, Some(LiveTracking::default()));
    let behind = 32 + 96 * 72 * 22;
    let mut points = 0;
    while points < 6 {
        let (head, frame) = running.get("/frame");
        assert!(head.starts_with("HTTP/1.1 200 OK"), "{head}");
        let whole = |at: usize| u32::from_le_bytes(frame[at..at + 4].try_into().unwrap()) as usize;
        let double = |at: usize| f64::from_le_bytes(frame[at..at + 8].try_into().unwrap());
        // A source of no stations: the first frame's axes, y up.
        assert_eq!((whole(behind), whole(behind + 60)), (1, 1));
        points = whole(behind + 64);
        assert_eq!(frame.len(), behind + 68 + 12 * points);
        let position = [0, 1, 2].map(|axis| double(behind + 4 + 8 * axis));
        // On a busy machine so many frames are dropped that the camera may be lost for one.
        if position.iter().any(|value| value.is_nan()) {
            continue;
        }
        assert!(position.iter().all(|value| value.abs() < 0.5), "{position:?}");
        let turn: f64 = (3..7).map(|axis| double(behind + 4 + 8 * axis).powi(2)).sum();
        assert!((turn - 1.0).abs() < 1e-9, "{turn}");
    }
    let status = String::from_utf8(running.get("/status").1).unwrap();
    assert!(status.contains("\"path\":{\"state\":\""), "{status}");
    let summary = running.end();
    let path = summary.path.as_ref().unwrap();
    assert!(path.lost < summary.frames - 5 && path.keyframes > 0, "{summary}");
}
