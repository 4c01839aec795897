//! What a survey says of the camera and of how it was used.

use range_io::survey::Survey;
use serde::Serialize;

/// Camera and conditions, as given; `None` where the survey does not say.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Conditions {
    /// Maker, model and serial number.
    pub camera_identity: Option<String>,
    /// Firmware.
    pub firmware: Option<String>,
    /// Who measured.
    pub operator: Option<String>,
    /// Columns and rows of the image.
    pub image_px: [usize; 2],
    /// Pitch of columns and rows, mm.
    pub pixel_pitch_mm: [f64; 2],
    /// Modulation frequencies, Hz.
    pub modulation_hz: Vec<f64>,
    /// Frames listed.
    pub frames: usize,
    /// Lowest and highest temperature of the frames, degrees Celsius.
    pub temperature_c: Option<[f64; 2]>,
    /// From how long after power-on until how long after the frames were taken, second.
    pub since_power_on_s: Option<[f64; 2]>,
}

impl Conditions {
    pub(crate) fn of(survey: &Survey) -> Self {
        let frames = || survey.frames.iter();
        let since = |time_s: f64| Some(time_s - survey.power_on_s?);
        Self {
            camera_identity: survey.camera_identity.clone(),
            firmware: survey.firmware.clone(),
            operator: survey.operator.clone(),
            image_px: [survey.camera.width, survey.camera.height],
            pixel_pitch_mm: survey.camera.pixel_pitch_mm,
            modulation_hz: survey.camera.modulation_hz.clone(),
            frames: survey.frames.len(),
            temperature_c: extent(frames().filter_map(|frame| frame.temperature_c)),
            since_power_on_s: extent(frames().filter_map(|frame| since(frame.timestamp_s?))),
        }
    }
}

/// Smallest and largest of the finite values.
pub(crate) fn extent(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    values.filter(|value| value.is_finite()).fold(None, |span: Option<[f64; 2]>, value| {
        let [low, high] = span.unwrap_or([value; 2]);
        Some([low.min(value), high.max(value)])
    })
}
