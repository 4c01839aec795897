//! Inertial samples between recordings and tables.

use std::path::Path;

use commands::Result;
use commands::range_io::limits::MOST_ROWS;
use commands::range_io::tables::{ImuSample, write_imu};
use recordings::{Imu, Measured, Payload};

use super::ImuUsed;

/// Name of the samples' file. It is none that commands read unasked: its axes are those of the unit, not of the camera.
pub(super) const FILE: &str = "recorded_imu.csv";

/// Samples as they are gathered from a recording.
#[derive(Default)]
pub(super) struct Samples {
    samples: Vec<ImuSample>,
    left_out: usize,
}

impl Samples {
    pub fn add(&mut self, time_ns: i64, imu: &Imu) {
        let sample = imu.angular_velocity.zip(imu.linear_acceleration).map(|(rate, force)| ImuSample {
            timestamp_s: time_ns as f64 * 1e-9,
            angular_rate: rate.value,
            acceleration: force.value,
        });
        let finite =
            |sample: &ImuSample| sample.angular_rate.iter().chain(&sample.acceleration).all(|value| value.is_finite());
        let later = |sample: &ImuSample| self.samples.last().is_none_or(|last| last.timestamp_s < sample.timestamp_s);
        match sample.filter(finite).filter(later).filter(|_| self.samples.len() < MOST_ROWS) {
            Some(sample) => self.samples.push(sample),
            None => self.left_out += 1,
        }
    }

    /// Writes the samples; `None` where there are none.
    pub fn write(&self, file: &Path, stream: &str) -> Result<Option<ImuUsed>> {
        if self.samples.is_empty() {
            return Ok(None);
        }
        write_imu(file, &self.samples)?;
        Ok(Some(ImuUsed {
            stream: stream.to_owned(),
            written_as: FILE.to_owned(),
            samples: self.samples.len(),
            left_out: self.left_out,
        }))
    }
}

/// A sample of a table as a message.
pub(super) fn payload(sample: &ImuSample) -> Payload {
    let measured = |value| Some(Measured { value, covariance: [0.0; 9] });
    Payload::Imu(Box::new(Imu {
        frame_id: "imu".to_owned(),
        orientation: None,
        angular_velocity: measured(sample.angular_rate),
        linear_acceleration: measured(sample.acceleration),
        angular_velocity_ns: None,
    }))
}
