//! Writes a small recording in MCAP: `cargo run -p recordings --all-features --example write -- out.mcap`.
#![allow(clippy::print_stdout)]

use std::fs::File;

use recordings::{CameraInfo, Encoding, Image, Imu, McapWriter, Measured, Payload};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("expected the name of a file to write")?;
    let mut writer = McapWriter::new(File::create(&path)?)?;
    let (camera, depth) = (writer.stream("/depth/camera_info")?, writer.stream("/depth/image_raw")?);
    let imu = writer.stream("/imu")?;
    let info = CameraInfo {
        frame_id: "depth".to_owned(),
        width: 32,
        height: 24,
        distortion_model: "plumb_bob".to_owned(),
        distortion: vec![0.1, -0.2, 0.001, -0.002, 0.05],
        matrix: [30.0, 0.0, 15.5, 0.0, 30.0, 11.5, 0.0, 0.0, 1.0],
        rectification: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        projection: [30.0, 0.0, 15.5, 0.0, 0.0, 30.0, 11.5, 0.0, 0.0, 0.0, 1.0, 0.0],
        ..CameraInfo::default()
    };
    for frame in 0..100_i64 {
        let time_ns = 1_700_000_000_000_000_000 + 33_333_333 * frame;
        writer.message(camera, time_ns, &Payload::CameraInfo(Box::new(info.clone())))?;
        let values: Vec<u16> = (0..32 * 24).map(|index| 1500 + index % 32 + frame as u16).collect();
        let image = Image::from_u16("depth", [32, 24], Encoding::Unsigned16, &values)?;
        writer.message(depth, time_ns, &Payload::Image(image))?;
        for sample in 0..10 {
            let rate = Measured { value: [0.0, 0.01 * frame as f64, 0.0], covariance: [0.0; 9] };
            let force = Measured { value: [0.0, 9.81, 0.0], covariance: [0.0; 9] };
            let imu_sample = Imu { angular_velocity: Some(rate), linear_acceleration: Some(force), ..Imu::default() };
            writer.message(imu, time_ns + 3_333_333 * sample, &Payload::Imu(Box::new(imu_sample)))?;
        }
    }
    writer.finish()?;
    println!("{path}: 100 depth images and 1000 inertial samples");
    Ok(())
}
