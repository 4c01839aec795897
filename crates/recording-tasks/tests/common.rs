//! Recordings that tests make themselves.

use std::fs::File;
use std::path::{Path, PathBuf};

use recordings::{CameraInfo, Encoding, Image, Imu, McapWriter, Measured, Message, Payload, Recording};

pub const START_NS: i64 = 1_700_000_000_000_000_000;
pub const SIZE: [u32; 2] = [8, 6];

pub fn depth(values: impl Fn(u32) -> u16) -> Payload {
    let values: Vec<u16> = (0..SIZE[0] * SIZE[1]).map(values).collect();
    Payload::Image(Image::from_u16("camera", SIZE, Encoding::Unsigned16, &values).unwrap())
}

pub fn light(value: u16) -> Payload {
    Payload::Image(Image::from_u16("camera", SIZE, Encoding::Mono16, &[value; 48]).unwrap())
}

pub fn camera(model: &str, distortion: &[f64]) -> CameraInfo {
    CameraInfo {
        frame_id: "camera".to_owned(),
        width: SIZE[0],
        height: SIZE[1],
        distortion_model: model.to_owned(),
        distortion: distortion.to_vec(),
        matrix: [10.0, 0.0, 3.25, 0.0, 10.5, 2.5, 0.0, 0.0, 1.0],
        rectification: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        projection: [9.0, 0.0, 3.5, 0.0, 0.0, 9.0, 2.5, 0.0, 0.0, 0.0, 1.0, 0.0],
        ..CameraInfo::default()
    }
}

pub fn imu(value: f64) -> Payload {
    let measured = |value| Some(Measured { value, covariance: [0.0; 9] });
    let (angular_velocity, linear_acceleration) = (measured([value, 0.0, 0.0]), measured([0.0, 9.81, value]));
    Payload::Imu(Box::new(Imu { angular_velocity, linear_acceleration, ..Imu::default() }))
}

/// Writes messages: topic, nanoseconds since [`START_NS`], what they hold.
pub fn write(folder: &Path, name: &str, messages: &[(&str, i64, Payload)]) -> PathBuf {
    let file = folder.join(name);
    let mut writer = McapWriter::new(File::create(&file).unwrap()).unwrap();
    for (topic, time, payload) in messages {
        let stream = writer.stream(topic).unwrap();
        writer.message(stream, START_NS + time, payload).unwrap();
    }
    writer.finish().unwrap();
    file
}

/// Ten frames at 30 Hz with light, camera, inertial samples and temperatures; the sixth is missing.
pub fn messages() -> Vec<(&'static str, i64, Payload)> {
    let mut messages = Vec::new();
    for frame in 0..10_i64 {
        let time = frame * 33_333_333;
        messages.push(("/imu", time + 1000, imu(frame as f64)));
        messages.push(("/imu", time + 16_000_000, imu(frame as f64 + 0.5)));
        if frame == 5 {
            continue;
        }
        if frame % 2 == 0 {
            messages.push(("/temperature", time, Payload::Temperature(30.0 + frame as f64)));
        }
        // The light comes before the depth or behind it.
        let image = depth(|index| if index == 3 { 0 } else { 1000 + 10 * index as u16 + frame as u16 });
        messages.push((
            "/camera/depth/camera_info",
            time,
            Payload::CameraInfo(Box::new(camera("plumb_bob", &[0.0; 5]))),
        ));
        let pair =
            [("/camera/depth/image_raw", time, image), ("/camera/ir/image_raw", time + 500_000, light(frame as u16))];
        messages.extend(if frame % 3 == 0 { pair.to_vec() } else { pair.into_iter().rev().collect::<Vec<_>>() });
    }
    messages
}

pub fn read(file: &Path) -> (Vec<(String, Message)>, Recording) {
    let mut recording = Recording::open(file).unwrap();
    let mut found = Vec::new();
    while let Some(message) = recording.next_message().unwrap() {
        found.push((recording.streams()[message.stream].name.clone(), message));
    }
    (found, recording)
}
