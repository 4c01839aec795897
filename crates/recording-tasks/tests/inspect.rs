//! What a recording holds.

use commands::{Judged, Silent, Verdict};
use recording_tasks::{inspect_recording, is_recording};
use recordings::Payload;

use crate::common::{messages, write};

#[test]
fn streams_rates_gaps_and_temperatures_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let file = write(folder.path(), "a.mcap", &messages());
    let found = inspect_recording(&file, &Silent).unwrap();
    assert_eq!((found.format, found.ended.as_str(), found.verdict()), ("MCAP", "complete", Verdict::Done));
    let stream = |name: &str| found.streams.iter().find(|stream| stream.name == name).unwrap();
    let depth = stream("/camera/depth/image_raw");
    assert_eq!((depth.kind, depth.messages, depth.stated), ("depth", 9, Some(9)));
    assert_eq!(depth.content.as_deref(), Some("8 x 6 16UC1"));
    assert!((depth.rate_hz.unwrap() - 30.0).abs() < 1e-4);
    assert_eq!((depth.gaps, depth.missing), (1, 1));
    let gap = depth.longest_gap.unwrap();
    assert!((gap.at_s - 4.0 / 30.0).abs() < 1e-6 && (gap.length_s - 2.0 / 30.0).abs() < 1e-6, "{gap:?}");
    assert_eq!(stream("/camera/ir/image_raw").kind, "intensity");
    // Two samples a frame, at unequal distances: none is twice the other.
    assert_eq!((stream("/imu").messages, stream("/imu").gaps), (20, 0));
    let temperature = &found.temperatures[0];
    assert_eq!((temperature.first_c, temperature.last_c, temperature.highest_c), (30.0, 38.0, 38.0));
    assert_eq!(found.cameras[0].focal_px, [10.0, 10.5]);
    let text = found.to_string();
    for words in ["/camera/depth/image_raw", "30.00", "Temperatures", "plumb_bob"] {
        assert!(text.contains(words), "{words} in {text}");
    }
    let json = serde_json::to_value(&found).unwrap();
    assert_eq!(json["streams"][0]["name"], "/imu");
    assert_eq!(json["doubts"].as_array().unwrap().len(), 0);
}

#[test]
fn a_recording_that_is_cut_off_is_doubtful_and_says_where() {
    let folder = tempfile::tempdir().unwrap();
    let file = write(folder.path(), "a.mcap", &messages());
    let bytes = std::fs::read(&file).unwrap();
    std::fs::write(&file, &bytes[..bytes.len() / 2]).unwrap();
    let found = inspect_recording(&file, &Silent).unwrap();
    assert_eq!(found.verdict(), Verdict::Doubtful);
    assert!(found.ended.starts_with("the recording is cut off at byte"), "{}", found.ended);
    assert!(found.ended.contains("bytes are missing"), "{}", found.ended);
}

#[test]
fn messages_out_of_order_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let times = [0, 10, 20, 15, 30, 30, 40, 130];
    let messages: Vec<_> = times.iter().map(|time| ("/t", time * 1_000_000, Payload::Temperature(20.0))).collect();
    let found = inspect_recording(&write(folder.path(), "a.mcap", &messages), &Silent).unwrap();
    let stream = &found.streams[0];
    assert_eq!((stream.not_ascending, stream.gaps, stream.missing), (2, 1, 8));
}

#[test]
fn recordings_are_told_by_what_they_hold() {
    let folder = tempfile::tempdir().unwrap();
    let file = write(folder.path(), "named.ply", &messages());
    assert!(is_recording(&file));
    let cloud = folder.path().join("cloud.mcap");
    std::fs::write(&cloud, "ply\nformat ascii 1.0\n").unwrap();
    assert!(!is_recording(&cloud) && !is_recording(folder.path()) && !is_recording(&folder.path().join("none")));
    let error = inspect_recording(&cloud, &Silent).unwrap_err().to_string();
    assert!(error.contains("is no recording that is known"), "{error}");
}
