//! What does not belong to the camera, or to no camera at all.

use live_tasks::commands::{Error, Failure, Judged, Verdict};
use live_tasks::range_image::Samples;
use live_tasks::{Ended, FrameHeader, LiveFrame, LiveRequest, LiveSource, StreamTarget, live};

use crate::common::{FRAMES, World, bytes};

fn usage(result: live_tasks::commands::Result<live_tasks::LiveSummary>, words: &[&str]) {
    let error = result.unwrap_err();
    assert_eq!(error.failure(), Failure::Usage, "{error}");
    for word in words {
        assert!(error.to_string().contains(word), "{error}: {word}");
    }
}

/// A frame of a camera of half the rows.
fn other(frame: &LiveFrame) -> LiveFrame {
    let header = FrameHeader { height: 12, ..frame.header };
    let Samples::U16(samples) = &frame.samples else { panic!() };
    LiveFrame { header, samples: Samples::U16(samples[..header.samples()].to_vec()), arrived: frame.arrived }
}

#[test]
fn the_first_frame_of_another_camera_is_wrong_input() {
    let world = World::new();
    let frame = &world.frames()[0];
    usage(world.stream(bytes(&other(frame))), &["32 x 12 pixels", "32 x 24 pixels"]);
    usage(world.stream(b"GET / HTTP/1.1\r\n\r\n".repeat(9)), &["byte 0", "GET ", "RCLF"]);
}

#[test]
fn later_frames_of_another_camera_are_counted_and_named_once() {
    let world = World::new();
    let frames = world.frames();
    let sent: Vec<u8> = frames.iter().flat_map(|frame| [bytes(frame), bytes(&other(frame))].concat()).collect();
    let summary = world.stream(sent).unwrap();
    assert_eq!((summary.frames, summary.refused.len(), summary.refused[0].frames), (FRAMES as u64, 1, FRAMES as u64));
    assert!(summary.refused[0].first.contains("32 x 12"), "{summary}");
    assert_eq!((summary.doubts().len(), summary.verdict()), (1, Verdict::Doubtful), "{summary}");
}

#[test]
fn a_stream_that_breaks_keeps_what_came() {
    let world = World::new();
    let sent = world.bytes();
    let summary = world.stream(sent[..sent.len() - 100].to_vec()).unwrap();
    assert_eq!((summary.frames, summary.ended), (FRAMES as u64 - 1, Ended::CutOff));
    assert!(summary.ended_words.as_ref().unwrap().contains("100 of its 6144 bytes are missing"), "{summary}");
    assert_eq!(summary.verdict(), Verdict::Doubtful);

    let mut damaged = sent;
    damaged[2 * 6208] = b'X';
    let summary = world.stream(damaged).unwrap();
    assert_eq!((summary.frames, summary.ended), (2, Ended::Damaged), "{summary}");
}

#[test]
fn nothing_is_a_refusal() {
    let world = World::new();
    for sent in [Vec::new(), world.bytes()[..6000].to_vec()] {
        let error = world.stream(sent).unwrap_err();
        assert!(matches!(error, Error::Refused { .. }) && error.to_string().contains("no frame"), "{error}");
    }
}

#[test]
fn times_that_step_back_are_refused_and_a_clock_may_begin_anew() {
    let world = World::new();
    let mut frames = world.frames();
    let time_s = frames[2].header.timestamp_s;
    frames[3].header.timestamp_s = time_s;
    for frame in &mut frames[5..] {
        frame.header.timestamp_s -= 50.0;
    }
    let summary = world.stream(frames.iter().flat_map(bytes).collect()).unwrap();
    assert_eq!((summary.frames, summary.restarts), (FRAMES as u64 - 1, 1), "{summary}");
    assert_eq!((summary.refused[0].reason, summary.refused[0].frames), ("time", 1));
}

#[test]
fn a_folder_with_damaged_files_goes_on() {
    let world = World::new();
    let folder = world.path("filling");
    std::fs::create_dir(&folder).unwrap();
    for (number, frame) in world.frames().iter().enumerate() {
        let mut sent = bytes(frame);
        match number {
            2 => sent.truncate(5000),
            4 => sent.push(0),
            6 => sent.clear(),
            _ => {}
        }
        std::fs::write(folder.join(format!("{number}.frame")), sent).unwrap();
    }
    std::fs::write(folder.join("9.other"), "not a frame").unwrap();
    std::fs::write(folder.join("end"), "").unwrap();
    let summary = live(&world.request(LiveSource::Path(folder)), &mut ()).unwrap();
    assert_eq!(
        (summary.frames, summary.refused.len(), summary.refused[0].frames),
        (FRAMES as u64 - 3, 1, 3),
        "{summary}"
    );
    assert!(summary.refused[0].first.contains("2.frame"), "{summary}");
}

#[test]
fn what_can_not_be_asked_for_is_refused_by_name() {
    let world = World::new();
    let file = world.path("frames");
    std::fs::write(&file, world.bytes()).unwrap();
    usage(live(&LiveRequest::new(LiveSource::Path(file.clone())), &mut ()), &["--survey"]);
    usage(live(&LiveRequest::new(LiveSource::Path(world.path("nowhere"))), &mut ()), &["nowhere"]);
    usage(live(&world.request(LiveSource::Path(world.path("nowhere"))), &mut ()), &["nowhere"]);
    usage(live(&world.request(LiveSource::of_name("unix:/nowhere/at/all")), &mut ()), &["unix:/nowhere"]);
    // Clouds over what is read.
    for out in ["survey", "survey/clouds.ply", "survey/frames/000_0.npz", "survey/../survey/x", "frames", "survey/a/b"]
    {
        let request = || world.request(LiveSource::Path(file.clone()));
        let target = Some(StreamTarget::File(world.path(out)));
        let before = std::fs::read(&file).unwrap();
        for request in
            [LiveRequest { ply: target.clone(), ..request() }, LiveRequest { mcap: target.clone(), ..request() }]
        {
            usage(live(&request, &mut ()), &["cannot be the output"]);
            assert_eq!(std::fs::read(&file).unwrap(), before);
        }
    }
    // Both streams into one.
    for target in [StreamTarget::StandardOutput, StreamTarget::File(world.path("both"))] {
        let request = LiveRequest {
            ply: Some(target.clone()),
            mcap: Some(target),
            ..world.request(LiveSource::Path(file.clone()))
        };
        usage(live(&request, &mut ()), &["each its own"]);
    }
    // Level and times of a recording.
    let survey = world.survey().join("survey.ron");
    let text = std::fs::read_to_string(&survey).unwrap();
    std::fs::write(&survey, text.replace("timestamp_s: ", "temperature_c: ")).unwrap();
    let recording = LiveRequest::new(LiveSource::Path(world.survey()));
    let twice = live(&recording, &mut ()).unwrap_err().to_string();
    assert!(twice.contains("timestamp_s") || twice.contains("temperature_c"), "{twice}");
    std::fs::write(&survey, text.replace("level: samples", "level: range")).unwrap();
    usage(live(&recording, &mut ()), &["range", "samples"]);
}
