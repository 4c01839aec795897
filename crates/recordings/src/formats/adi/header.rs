//! The head of an `.adcam`: how many frames, of what camera.

use crate::payload::CameraInfo;

/// What stands before each record: its mark and its length.
pub(super) const MARK: u32 = 0xFFFF_FFFF;

/// Bytes of the head in version 1, as 64-bit compilers lay the structure out.
pub(super) const LENGTH: usize = 664;

/// What a head says.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Header {
    /// Number of frames; 0 until the recorder has closed the file.
    pub frames: u32,
    pub frame_rate: u16,
    /// Whether the brightness begins with the head of its frame.
    pub head_in_brightness: bool,
    pub width: u32,
    pub height: u32,
    pub has_depth: bool,
    pub has_brightness: bool,
    /// The factory's lens, for the pixels of the images.
    pub lens: Option<CameraInfo>,
}

/// Whether a file begins as an `.adcam`.
pub(crate) fn is_header(beginning: &[u8]) -> bool {
    let number = |at: usize| beginning.get(at..at + 4).and_then(|four| four.try_into().ok()).map(u32::from_le_bytes);
    number(0) == Some(MARK) && number(4) == Some(LENGTH as u32) && number(12) == Some(1)
}

impl Header {
    /// The head behind its mark and length; `None` where its values are no camera's.
    pub fn read(bytes: &[u8]) -> Option<Self> {
        let bytes = bytes.first_chunk::<LENGTH>()?;
        let u16_at = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
        let u32_at = |at: usize| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
        let [width, height] = [104, 108].map(u32_at);
        if !(1..=4096).contains(&width) || !(1..=4096).contains(&height) {
            return None;
        }
        // Names of planes, each of 32 bytes before five numbers.
        let planes = (u32_at(244) as usize).min(8);
        let name = |index: usize| {
            let name = &bytes[248 + 52 * index..][..32];
            &name[..name.iter().position(|&byte| byte == 0).unwrap_or(32)]
        };
        let has = |wanted: &str| (0..planes).any(|index| name(index) == wanted.as_bytes());
        Some(Self {
            frames: u32_at(0),
            frame_rate: u16_at(8),
            head_in_brightness: u16_at(10) != 0,
            width,
            height,
            has_depth: has("depth"),
            has_brightness: has("ab"),
            lens: lens(bytes, width, height),
        })
    }
}

/// The lens: intrinsics count in pixels of the full sensor, images in binned pixels of a window.
fn lens(bytes: &[u8; LENGTH], width: u32, height: u32) -> Option<CameraInfo> {
    let u16_at = |at: usize| f64::from(u16::from_le_bytes([bytes[at], bytes[at + 1]]));
    let values: [f64; 14] = std::array::from_fn(|index| {
        let at = 44 + 4 * index;
        f64::from(f32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]))
    });
    let [fx, fy, cx, cy, codx, cody, k1, k2, k3, k4, k5, k6, p2, p1] = values;
    let [row_bin, col_bin] = [21, 22].map(|at| f64::from(bytes[at].max(1)));
    let [rows, cols] = [24, 26].map(u16_at);
    let finite = values.iter().all(|value| value.is_finite());
    // The centre of distortion is zero in this model; another value would be silently wrong.
    // Nor is it told what is meant where rows and columns are binned differently.
    let one_binning = bytes[21].max(1) == bytes[22].max(1);
    if !finite || !one_binning || fx <= 0.0 || fy <= 0.0 || codx.abs() + cody.abs() > 0.0 {
        return None;
    }
    let matrix = [fx / col_bin, 0.0, cx / col_bin - cols, 0.0, fy / row_bin, cy / row_bin - rows, 0.0, 0.0, 1.0];
    Some(CameraInfo {
        frame_id: "adi".to_owned(),
        width,
        height,
        distortion_model: "rational_polynomial".to_owned(),
        distortion: vec![k1, k2, p1, p2, k3, k4, k5, k6],
        matrix,
        ..CameraInfo::default()
    })
}
