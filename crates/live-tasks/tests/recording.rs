//! Images of processed frames as a recording.

use live_tasks::{LiveRequest, LiveSource, StreamTarget, live};
use range_io::clouds::read_any_cloud;
use recordings::{Ending, Kind, Payload, Recording};

use crate::common::{FRAMES, World};

#[test]
fn a_recording_holds_what_the_clouds_hold() {
    let world = World::new();
    let [file, clouds] = ["out.mcap", "out.ply"].map(|name| world.path(name));
    let request = LiveRequest {
        mcap: Some(StreamTarget::File(file.clone())),
        ply: Some(StreamTarget::File(clouds.clone())),
        ..world.request(LiveSource::Path(world.survey()))
    };
    let summary = live(&request, &mut ()).unwrap();
    assert_eq!(summary.recording, Some(file.clone()));

    let mut recording = Recording::open(&file).unwrap();
    let counts: Vec<Option<u64>> = recording.streams().iter().map(|stream| stream.count).collect();
    assert_eq!(counts, [Some(FRAMES as u64); 4]);
    let (mut ranges, mut times) = (Vec::new(), Vec::new());
    while let Some(message) = recording.next_message().unwrap() {
        let Payload::Image(image) = &message.payload else { panic!("{message:?}") };
        if message.stream == 0 {
            times.push(1e-9 * message.logged_ns as f64);
            ranges.push(image.values_f32().unwrap());
        }
    }
    assert_eq!(recording.ending(), Some(&Ending::Complete));
    // One stream of ranges: what is made a survey of needs no name.
    let kinds: Vec<Kind> = recording.streams().iter().map(|stream| stream.kind).collect();
    assert_eq!(kinds, [Kind::Range, Kind::Raw, Kind::Intensity, Kind::Raw]);
    for (time, frame) in times.iter().zip(world.frames()) {
        assert!((time - frame.header.timestamp_s).abs() < 1e-6, "{time}");
    }
    // The first cloud of the stream: a range is the length of its point.
    let first = read_any_cloud(&clouds).unwrap();
    let finite = ranges[0].iter().filter(|range| range.is_finite());
    assert_eq!(finite.clone().count(), first.points.len());
    for (range, [x, y, z]) in finite.zip(&first.points) {
        assert!((f64::from(*range) - x.hypot(*y).hypot(*z)).abs() < 1e-5, "{range}");
    }
}

#[test]
fn a_time_that_a_recording_has_no_room_for_is_said() {
    let world = World::new();
    let mut frame = world.frames().remove(0);
    frame.header.timestamp_s = -2.0;
    let file = world.path("frame");
    std::fs::write(&file, crate::common::bytes(&frame)).unwrap();
    let out = world.path("out.mcap");
    let request = LiveRequest { mcap: Some(StreamTarget::File(out.clone())), ..world.request(LiveSource::Path(file)) };
    let words = live(&request, &mut ()).unwrap_err().to_string();
    assert!(words.contains("1970") && words.contains("out.mcap"), "{words}");
    assert!(!out.exists(), "no half of a recording");
}
