//! The path as the page draws it.

use live_frames::ProcessedFrame;

/// Most points of the line, which is thinned to every second where it would have more: it may be hours long.
const MOST_POINTS: usize = 1024;

/// Positions of the camera, NaN where it was lost in between.
#[derive(Debug)]
pub(super) struct PathLine {
    points: Vec<[f32; 3]>,
    /// Every so many frames give a point.
    every: u64,
    frames: u64,
    last: Option<u64>,
    vertical_axis: u32,
}

impl PathLine {
    pub(super) fn new(vertical_axis: usize) -> Self {
        Self { points: Vec::new(), every: 1, frames: 0, last: None, vertical_axis: vertical_axis as u32 }
    }

    /// Takes the position of a frame, once.
    pub(super) fn follow(&mut self, frame: &ProcessedFrame) {
        let Some(pose) = frame.pose.filter(|_| self.last != Some(frame.number)) else { return };
        self.last = Some(frame.number);
        if !pose.state.has_pose() {
            if self.points.last().is_some_and(|point| !point[0].is_nan()) {
                self.points.push([f32::NAN; 3]);
            }
            return;
        }
        self.frames += 1;
        if (self.frames - 1).is_multiple_of(self.every) {
            let position = pose.world_from_camera.translation.vector;
            self.points.push([position.x as f32, position.y as f32, position.z as f32]);
        }
        if self.points.len() >= MOST_POINTS {
            self.thin();
        }
    }

    /// Leaves out every second point, and no gap.
    fn thin(&mut self) {
        self.every *= 2;
        let mut keep = false;
        self.points.retain(|point| {
            keep = !keep || point[0].is_nan();
            keep
        });
        // Gaps alone: the oldest go.
        let surplus = self.points.len().saturating_sub(MOST_POINTS * 3 / 4);
        self.points.drain(..surplus);
    }

    /// Writes, little-endian: whether poses are sought (u32, 0 or 1: all that follows is there only then), the pose of the frame
    /// (seven f64: position, quaternion x y z w of the camera's axes x right, y up, looking along -z; NaN where there is none), the
    /// index of the vertical axis (u32), the number of points (u32) and the points (three f32 each, NaN for a gap).
    pub(super) fn write(&self, frame: &ProcessedFrame, bytes: &mut Vec<u8>) {
        bytes.extend(u32::from(frame.pose.is_some()).to_le_bytes());
        let Some(pose) = frame.pose else { return };
        let (t, q) = (pose.world_from_camera.translation.vector, pose.world_from_camera.rotation.coords);
        for value in [t.x, t.y, t.z, q.x, q.y, q.z, q.w] {
            bytes.extend(if pose.state.has_pose() { value } else { f64::NAN }.to_le_bytes());
        }
        bytes.extend(self.vertical_axis.to_le_bytes());
        bytes.extend((self.points.len() as u32).to_le_bytes());
        self.points.iter().flatten().for_each(|value| bytes.extend(value.to_le_bytes()));
    }
}
