//! The factory calibration of an Azure Kinect: `calibration.json`, beside a recording or attached to it.

use std::path::Path;

use serde::Deserialize;

use crate::{Error, Result, read_ron_text};

/// Intrinsics of the depth camera for the images of one mode: the rational model of `OpenCV` (`CALIB_RATIONAL_MODEL`),
/// computer-vision axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RationalIntrinsics {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Focal lengths in pixels along a row and along a column.
    pub focal_px: [f64; 2],
    /// Principal point `(col, row)` in pixels, integers at pixel centres.
    pub principal_point_px: [f64; 2],
    /// Radial coefficients k1..k6: the factor is `(1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶)`.
    pub radial: [f64; 6],
    /// Decentring coefficients p1, p2.
    pub decentring: [f64; 2],
    /// Largest radius `r` of a normalised image point that the model holds for, 0 where it is not stated.
    pub metric_radius: f64,
}

/// Modes of the depth camera: binning and crop of the sensor's 1024 x 1024 pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DepthMode {
    /// Narrow field of view, 320 x 288.
    NarrowBinned,
    /// Narrow field of view, 640 x 576.
    #[default]
    NarrowUnbinned,
    /// Wide field of view, 512 x 512.
    WideBinned,
    /// Wide field of view, 1024 x 1024.
    WideUnbinned,
}

impl DepthMode {
    /// Size of the binned sensor, first pixel of the crop, size of the image.
    fn geometry(self) -> (f64, [f64; 2], [usize; 2]) {
        match self {
            Self::NarrowBinned => (512.0, [96.0, 90.0], [320, 288]),
            Self::NarrowUnbinned => (1024.0, [192.0, 180.0], [640, 576]),
            Self::WideBinned => (512.0, [0.0, 0.0], [512, 512]),
            Self::WideUnbinned => (1024.0, [0.0, 0.0], [1024, 1024]),
        }
    }
}

/// Reads the depth camera's intrinsics from a `calibration.json`.
pub fn read(path: impl AsRef<Path>, mode: DepthMode) -> Result<RationalIntrinsics> {
    let path = path.as_ref();
    parse(path, &read_ron_text(path)?, mode)
}

/// Reads the depth camera's intrinsics from the text of a `calibration.json`; `file` stands for it in messages.
pub fn parse(file: &Path, text: &str, mode: DepthMode) -> Result<RationalIntrinsics> {
    let calibration: CalibrationFile = serde_json::from_str(text.trim_end_matches('\0')).map_err(|error| {
        let (line, column) = (error.line(), error.column());
        let field = String::new();
        Error::Text { file: file.to_path_buf(), line, column, field, reason: error.to_string() }
    })?;
    let cameras = calibration.information.cameras;
    let depth = cameras.iter().find(|camera| camera.location == "CALIBRATION_CameraLocationD0");
    let depth = depth.ok_or_else(|| Error::format(file, "has no camera at CALIBRATION_CameraLocationD0"))?;
    let Intrinsics { model, parameters } = &depth.intrinsics;
    if model != "CALIBRATION_LensDistortionModelBrownConrady" {
        let expected = "expected CALIBRATION_LensDistortionModelBrownConrady";
        return Err(Error::format(file, format!("has the lens model {model}, {expected}")));
    }
    let parameters: [f64; 14] = parameters.as_slice().try_into().map_err(|_| {
        Error::format(file, format!("has {} parameters of the depth camera, expected 14", parameters.len()))
    })?;
    intrinsics(parameters, depth.metric_radius, mode)
        .ok_or_else(|| Error::format(file, format!("has parameters {parameters:?} that are no camera's")))
}

/// The file counts in parts of the sensor's size from its corner, the image in pixels from the first one's centre.
fn intrinsics(parameters: [f64; 14], metric_radius: f64, mode: DepthMode) -> Option<RationalIntrinsics> {
    let [cx, cy, fx, fy, k1, k2, k3, k4, k5, k6, codx, cody, p2, p1] = parameters;
    let (sensor, crop, [width, height]) = mode.geometry();
    let finite = parameters.iter().all(|value| value.is_finite()) && metric_radius.is_finite();
    // The centre of distortion is zero in this model; another value would be silently wrong.
    let centred = codx.abs() + cody.abs() <= 0.0;
    (finite && centred && fx > 0.0 && fy > 0.0).then_some(RationalIntrinsics {
        width,
        height,
        focal_px: [fx * sensor, fy * sensor],
        principal_point_px: [cx * sensor - crop[0] - 0.5, cy * sensor - crop[1] - 0.5],
        radial: [k1, k2, k3, k4, k5, k6],
        decentring: [p1, p2],
        metric_radius,
    })
}

#[derive(Deserialize)]
struct CalibrationFile {
    #[serde(rename = "CalibrationInformation")]
    information: Information,
}

#[derive(Deserialize)]
struct Information {
    #[serde(rename = "Cameras")]
    cameras: Vec<CameraEntry>,
}

#[derive(Deserialize)]
struct CameraEntry {
    #[serde(rename = "Location")]
    location: String,
    #[serde(rename = "Intrinsics")]
    intrinsics: Intrinsics,
    #[serde(rename = "MetricRadius", default)]
    metric_radius: f64,
}

#[derive(Deserialize)]
struct Intrinsics {
    #[serde(rename = "ModelType")]
    model: String,
    #[serde(rename = "ModelParameters")]
    parameters: Vec<f64>,
}
