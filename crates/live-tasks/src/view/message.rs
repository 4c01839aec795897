//! A frame as the page gets it.

use live_frames::ProcessedFrame;

/// Largest picture of the page, columns and rows.
const LARGEST: [usize; 2] = [320, 240];
/// First bytes of the message.
const MAGIC: &[u8; 4] = b"RCLV";

/// Writes a frame, thinned to at most 320 x 240 pixels, little-endian: `RCLV`, columns, rows and step (u32), number (f64), time
/// stamp (f64); then plane by plane range (f32, metre), amplitude (f32), points (three f32 a pixel, camera's frame) and
/// flags (u16). Behind them stands the path.
pub(super) fn write(frame: &ProcessedFrame, bytes: &mut Vec<u8>) {
    bytes.clear();
    let (width, height) = (frame.width(), frame.height());
    let step = width.div_ceil(LARGEST[0]).max(height.div_ceil(LARGEST[1])).max(1);
    let pixels =
        || (0..height).step_by(step).flat_map(move |row| (0..width).step_by(step).map(move |col| row * width + col));
    bytes.extend(MAGIC);
    for number in [width.div_ceil(step), height.div_ceil(step), step] {
        bytes.extend((number as u32).to_le_bytes());
    }
    bytes.extend((frame.number as f64).to_le_bytes());
    bytes.extend(frame.timestamp_s.to_le_bytes());
    for plane in [&frame.range, &frame.amplitude] {
        let plane = plane.as_slice();
        pixels().for_each(|index| bytes.extend(plane[index].to_le_bytes()));
    }
    for index in pixels() {
        frame.points[index].iter().for_each(|value| bytes.extend(value.to_le_bytes()));
    }
    let flags = frame.flags.as_slice();
    pixels().for_each(|index| bytes.extend(flags[index].bits().to_le_bytes()));
}
