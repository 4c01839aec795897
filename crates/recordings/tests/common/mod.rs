//! Recordings that tests make themselves, and what they read.
#![allow(dead_code, clippy::float_cmp, clippy::panic, clippy::unwrap_used)]

pub mod adi;
pub mod bag;
pub mod mcap;
pub mod mkv;

use std::io::Cursor;

use recordings::{CameraInfo, Encoding, Ending, Image, Imu, Measured, Message, Payload, Recording};

/// A time in 2023, nanosecond.
pub const START_NS: i64 = 1_700_000_000_000_000_000;

/// A recording in memory.
pub fn open(bytes: &[u8]) -> Recording {
    Recording::from_reader("memory", Cursor::new(bytes.to_vec())).unwrap()
}

/// All messages, and the recording at its end.
pub fn read(bytes: &[u8]) -> (Vec<Message>, Recording) {
    let mut recording = open(bytes);
    let mut messages = Vec::new();
    while let Some(message) = recording.next_message().unwrap() {
        messages.push(message);
    }
    assert!(recording.next_message().unwrap().is_none() && recording.ending().is_some());
    (messages, recording)
}

/// A depth image of 4 x 3 millimetres.
pub fn depth(number: u16) -> Payload {
    let values: Vec<u16> = (0..12).map(|index| if index == 5 { 0 } else { 1000 + 10 * index + number }).collect();
    Payload::Image(Image::from_u16("camera_depth", [4, 3], Encoding::Unsigned16, &values).unwrap())
}

/// An image of light of 4 x 3 pixels.
pub fn infrared(number: u16) -> Payload {
    let values: Vec<u16> = (0..12).map(|index| 7 * index + number).collect();
    Payload::Image(Image::from_u16("camera_ir", [4, 3], Encoding::Mono16, &values).unwrap())
}

/// A camera with five coefficients.
pub fn camera() -> Payload {
    Payload::CameraInfo(Box::new(CameraInfo {
        frame_id: "camera_depth".to_owned(),
        width: 4,
        height: 3,
        distortion_model: "plumb_bob".to_owned(),
        distortion: vec![0.1, -0.2, 0.001, -0.002, 0.05],
        matrix: [5.0, 0.0, 1.5, 0.0, 5.1, 1.0, 0.0, 0.0, 1.0],
        rectification: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        projection: [5.0, 0.0, 1.5, 0.0, 0.0, 5.1, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        binning: [1, 2],
        window: [3, 4, 5, 6],
        rectify: true,
    }))
}

/// A sample without orientation.
pub fn imu(number: f64) -> Payload {
    let measured =
        |value: [f64; 3]| Some(Measured { value, covariance: [0.25, 0.0, 0.0, 0.0, 0.25, 0.0, 0.0, 0.0, 0.25] });
    Payload::Imu(Box::new(Imu {
        frame_id: "imu".to_owned(),
        orientation: None,
        angular_velocity: measured([0.1, -0.2, 0.3 + number]),
        linear_acceleration: measured([0.0, 9.81, 0.5 - number]),
        angular_velocity_ns: None,
    }))
}

/// The messages of the recordings: topic, nanoseconds since [`START_NS`], what it holds.
pub fn messages() -> Vec<(&'static str, i64, Payload)> {
    let mut messages = vec![("/camera/depth/camera_info", 0, camera())];
    for frame in 0..6_u16 {
        let time = i64::from(frame) * 33_000_000;
        messages.push(("/camera/depth/image_raw", time, depth(frame)));
        messages.push(("/camera/ir/image_raw", time + 1000, infrared(frame)));
        for sample in 0..3 {
            let sample_time = time + 10_000_000 * sample;
            messages.push(("/imu", sample_time + 2000, imu(f64::from(frame) + sample as f64 * 0.1)));
        }
    }
    messages
}

/// Name of a message's stream.
pub fn name(recording: &Recording, message: &Message) -> String {
    recording.streams()[message.stream].name.clone()
}

/// What a recording holds is what [`messages`] wrote, as far as `count` of them.
pub fn check(bytes: &[u8], count: usize) -> Recording {
    let (found, recording) = read(bytes);
    assert_eq!(found.len(), count);
    for (message, (topic, time, payload)) in found.iter().zip(messages()) {
        assert_eq!(name(&recording, message), topic);
        assert_eq!(message.time_ns(), START_NS + time);
        assert_eq!(message.logged_ns, START_NS + time);
        assert_eq!(message.payload, payload);
    }
    recording
}

/// Every cut of a recording gives the first messages of the whole one, and says that something is missing.
pub fn cut_everywhere(bytes: &[u8], step: usize) {
    let (whole, recording) = read(bytes);
    assert_eq!(recording.ending(), Some(&Ending::Complete));
    let mut longest = 0;
    for length in (0..bytes.len()).step_by(step) {
        let Ok(mut recording) = Recording::from_reader("cut", Cursor::new(bytes[..length].to_vec())) else {
            assert!(length < 200, "a recording of {length} bytes is not opened");
            continue;
        };
        let mut count = 0;
        while let Some(message) = recording.next_message().unwrap() {
            assert_eq!(message, whole[count], "cut at {length}");
            count += 1;
        }
        let Some(Ending::CutOff { at_byte, missing_bytes, .. }) = recording.ending() else {
            panic!("cut at {length} of {}: {:?}", bytes.len(), recording.ending());
        };
        assert!(
            *at_byte <= length as u64 && missing_bytes.is_none_or(|missing| missing <= (bytes.len() - length) as u64)
        );
        assert!(count >= longest, "cut at {length}");
        longest = count;
    }
}
