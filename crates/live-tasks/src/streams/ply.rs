//! Clouds one after the other in one stream.

use std::fmt::Write as _;
use std::io::{Result, Write};

use live_frames::ProcessedFrame;
use live_frames::tracking::nalgebra::Point3;
use live_frames::tracking::{TrackedPose, TrackingState};
use range_image::Raster;

/// Bytes of a point.
const RECORD: usize = 5 * 4 + 2;

/// Writer of a stream of clouds: complete binary PLY files, one a frame, that follow each other.
///
/// Each has `x y z` (metre; camera's frame, or that of the world where the frame has a pose, which the header then says), `intensity`, `sigma` and `flags` of the pixels that have a point, and its time
/// stamp as a comment. A point with a flag should not be trusted as it is.
#[derive(Debug)]
pub struct PlyStream<W> {
    writer: W,
    bytes: Vec<u8>,
    header: String,
}

impl<W: Write> PlyStream<W> {
    /// A stream that goes to a writer.
    pub fn new(writer: W) -> Self {
        Self { writer, bytes: Vec::new(), header: String::new() }
    }

    /// Writes a frame's points, how many there were.
    ///
    /// # Errors
    /// What the writer says.
    pub fn write(&mut self, frame: &ProcessedFrame) -> Result<usize> {
        self.bytes.clear();
        let mut count = 0;
        let planes = [&frame.amplitude, &frame.sigma].map(Raster::as_slice);
        let pose = frame.pose.filter(|pose| pose.state.has_pose()).map(|pose| pose.world_from_camera);
        for (index, (point, flags)) in frame.points.iter().zip(frame.flags.as_slice()).enumerate() {
            if !point.iter().all(|value| value.is_finite()) {
                continue;
            }
            count += 1;
            let point = Point3::from(point.map(f64::from));
            let place = pose.map_or(point, |pose| pose * point);
            let [x, y, z] = [0, 1, 2].map(|axis| place[axis] as f32);
            let values = [x, y, z, planes[0][index], planes[1][index]];
            let mut record = [0; RECORD];
            for (bytes, value) in record.chunks_exact_mut(4).zip(values) {
                bytes.copy_from_slice(&value.to_le_bytes());
            }
            record[RECORD - 2..].copy_from_slice(&flags.bits().to_le_bytes());
            self.bytes.extend_from_slice(&record);
        }
        self.header.clear();
        // Writing to a string can't fail.
        let _ = write!(
            self.header,
            "ply\nformat binary_little_endian 1.0\ncomment metres\ncomment timestamp_s {}\n",
            frame.timestamp_s
        );
        if let Some(pose) = &frame.pose {
            say_coordinates(pose, &mut self.header);
        }
        let _ = writeln!(self.header, "element vertex {count}");
        for name in ["x", "y", "z", "intensity", "sigma"] {
            let _ = writeln!(self.header, "property float {name}");
        }
        self.header.push_str("property ushort flags\nend_header\n");
        self.writer.write_all(self.header.as_bytes())?;
        self.writer.write_all(&self.bytes)?;
        self.writer.flush()?;
        Ok(count)
    }

    /// The writer.
    pub fn into_inner(self) -> W {
        self.writer
    }
}

/// Which coordinates a cloud has where poses are sought; those of a frame without a pose are the camera's.
fn say_coordinates(pose: &TrackedPose, header: &mut String) {
    // Writing to a string can't fail.
    let _ = if let TrackingState::Lost(reason) = pose.state {
        write!(header, "comment coordinates camera\ncomment no pose: {}\n", reason.words())
    } else {
        let (t, q) = (pose.world_from_camera.translation.vector, pose.world_from_camera.rotation.coords);
        let numbers = [t.x, t.y, t.z, q.x, q.y, q.z, q.w].map(|number| number.to_string()).join(" ");
        write!(header, "comment coordinates world\ncomment world_from_camera {numbers}\n")
    };
}
