//! The same frames give the same clouds, whatever way they come.

use std::io::Write;
use std::time::{Duration, Instant};

use live_tasks::{Ended, LiveRequest, LiveSource, LiveSummary, live};

use crate::common::{FRAMES, World, bytes};

fn require_same(summary: &LiveSummary, found: &[u8], expected: &[u8]) {
    assert_eq!((summary.frames, summary.dropped, summary.ended), (FRAMES as u64, 0, Ended::Source), "{summary}");
    assert!(summary.doubts.is_empty(), "{summary}");
    assert!(found == expected, "{}", summary.source);
}

#[test]
fn a_pipe_a_socket_and_a_folder_give_the_clouds_of_the_recording() {
    let world = World::new();
    let played = LiveRequest { every_frame: true, ..LiveRequest::new(LiveSource::Path(world.survey())) };
    let (summary, expected) = world.clouds(played);
    require_same(&summary, &expected, &expected);
    assert!(summary.points > (FRAMES * 32 * 24 * 9 / 10) as u64, "{summary}");

    // A file, as a named pipe would be.
    let file = world.path("frames");
    std::fs::write(&file, world.bytes()).unwrap();
    let (summary, found) = world.clouds(world.request(LiveSource::Path(file)));
    require_same(&summary, &found, &expected);

    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let source = LiveSource::of_name(&format!("tcp:{}", listener.local_addr().unwrap()));
    let sent = world.bytes();
    let server = std::thread::spawn(move || listener.accept().unwrap().0.write_all(&sent).unwrap());
    let (summary, found) = world.clouds(world.request(source));
    server.join().unwrap();
    require_same(&summary, &found, &expected);

    let folder = world.path("filling");
    std::fs::create_dir(&folder).unwrap();
    let frames = world.frames();
    let to = folder.clone();
    let server = std::thread::spawn(move || {
        for (number, frame) in frames.iter().enumerate() {
            std::fs::write(to.join("part"), bytes(frame)).unwrap();
            std::fs::rename(to.join("part"), to.join(format!("{number:03}.frame"))).unwrap();
            std::thread::sleep(Duration::from_millis(5));
        }
        std::fs::write(to.join("end"), "").unwrap();
    });
    let (summary, found) = world.clouds(world.request(LiveSource::Path(folder)));
    server.join().unwrap();
    require_same(&summary, &found, &expected);
}

#[cfg(unix)]
#[test]
fn a_unix_socket_gives_the_clouds_of_the_recording() {
    let world = World::new();
    let played = LiveRequest { every_frame: true, ..LiveRequest::new(LiveSource::Path(world.survey())) };
    let (_, expected) = world.clouds(played);
    let socket = world.path("camera");
    let listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
    let sent = world.bytes();
    let server = std::thread::spawn(move || listener.accept().unwrap().0.write_all(&sent).unwrap());
    let (summary, found) = world.clouds(world.request(LiveSource::of_name(&format!("unix:{}", socket.display()))));
    server.join().unwrap();
    require_same(&summary, &found, &expected);
}

#[test]
fn a_recording_takes_as_long_as_it_took() {
    let world = World::new();
    let begin = Instant::now();
    let summary = live(&LiveRequest::new(LiveSource::Path(world.survey())), &mut ()).unwrap();
    // The last frame is due seven intervals of 20 ms after the first.
    assert!(begin.elapsed() >= Duration::from_millis(139), "{summary}");
    assert_eq!(summary.frames + summary.dropped, FRAMES as u64);
    let latency = summary.latency.unwrap();
    assert!(latency.p50_ms <= latency.p95_ms && latency.p95_ms <= latency.p99_ms);
    assert!(latency.p99_ms <= latency.largest_ms && latency.p50_ms > 0.0);
}

#[test]
fn it_ends_after_the_frames_that_were_asked_for() {
    let world = World::new();
    let request = LiveRequest { frames: Some(3), ..world.request(LiveSource::Path(world.survey())) };
    let summary = live(&request, &mut ()).unwrap();
    assert_eq!((summary.frames, summary.ended), (3, Ended::Frames));
}
