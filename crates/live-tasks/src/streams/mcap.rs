//! Images one after the other in one recording.

use std::io::{self, Write};

use live_frames::ProcessedFrame;
use range_image::Flags;
use recordings::{Encoding, Error, Image, McapWriter, Payload, StreamId, Transform};

use super::trajectory::pose_numbers;

/// Topics of a recording, in the order in which a frame's messages are written.
const TOPICS: [&str; 4] = ["/range/image_raw", "/sigma/image_raw", "/amplitude/image_raw", "/flags/image_raw"];
/// Topic of the poses: the one that viewers of ROS take coordinate systems from.
const TRANSFORMS: &str = "/tf";
/// Names of the camera's coordinate system (computer-vision axes, as for all images of ROS) and of the world's.
const CAMERA: &str = "camera";
const WORLD: &str = "world";

/// Writer of processed frames as MCAP: four images a frame with its time stamp, which `rangecam convert --calibration FILE` makes a survey of.
///
/// `/range`, `/sigma` (metre) and `/amplitude` (the samples' unit) are `32FC1` with NaN for none, `/flags` is `16UC1`. Where poses are sought,
/// `/tf` says where `camera` lies in `world` at each frame that has one. The file has its index from [`finish`](Self::finish) on.
pub struct McapStream<W: Write> {
    writer: McapWriter<W>,
    topics: [StreamId; 4],
}

impl<W: Write> McapStream<W> {
    /// A recording that goes to a writer.
    ///
    /// # Errors
    /// What the writer says.
    pub fn new(writer: W) -> io::Result<Self> {
        let mut writer = McapWriter::new(writer)?;
        let mut topics = Vec::with_capacity(TOPICS.len());
        for topic in TOPICS {
            topics.push(writer.stream(topic).map_err(as_io)?);
        }
        let topics = topics.try_into().map_err(|_| io::Error::other("four topics"))?;
        Ok(Self { writer, topics })
    }

    /// Writes a frame.
    ///
    /// # Errors
    /// What the writer says; [`io::ErrorKind::InvalidInput`] for a time stamp before 0 or beyond 2038, which MCAP has no room for.
    pub fn write(&mut self, frame: &ProcessedFrame) -> io::Result<()> {
        // Times of today in double precision are exact to 0.24 µs.
        let time_ns = (1e9 * frame.timestamp_s).round() as i64;
        let size = [frame.width() as u32, frame.height() as u32];
        let metres = |values: &[f32]| Image::from_f32(CAMERA, size, values);
        let flags: Vec<u16> = frame.flags.as_slice().iter().map(Flags::bits).collect();
        let images = [
            metres(frame.range.as_slice()),
            metres(frame.sigma.as_slice()),
            metres(frame.amplitude.as_slice()),
            Image::from_u16(CAMERA, size, Encoding::Unsigned16, &flags),
        ];
        for (topic, image) in self.topics.into_iter().zip(images) {
            let image = image.map_err(as_io)?;
            self.writer.message(topic, time_ns, &Payload::Image(image)).map_err(as_io)?;
        }
        let Some(pose) = frame.pose.filter(|pose| pose.state.has_pose()) else { return Ok(()) };
        let [x, y, z, qx, qy, qz, qw] = pose_numbers(&pose.world_from_camera);
        let place = Transform {
            parent: WORLD.to_owned(),
            child: CAMERA.to_owned(),
            translation_m: [x, y, z],
            rotation: [qx, qy, qz, qw],
        };
        let topic = self.writer.stream(TRANSFORMS).map_err(as_io)?;
        self.writer.message(topic, time_ns, &Payload::Transforms(vec![place])).map_err(as_io)
    }

    /// Ends the recording with its index; the writer.
    ///
    /// # Errors
    /// What the writer says.
    pub fn finish(self) -> io::Result<W> {
        self.writer.finish()
    }
}

fn as_io(error: Error) -> io::Error {
    match error {
        Error::Io { source, .. } => source,
        other => io::Error::new(io::ErrorKind::InvalidInput, other.to_string()),
    }
}
