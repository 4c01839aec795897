//! A survey: the folder of one capture, described by its `survey.ron`.

mod arrays;
mod camera;
mod depth;
mod frame;
#[cfg(feature = "png16")]
mod sequence;
mod truth;
mod validate;
mod write;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

pub use camera::SurveyCamera;
pub use frame::{InputFrame, read_frame};
pub use range_image::PhaseSense;
pub use truth::{TruthFrame, read_truth, write_truth};
pub use write::write_frame;

use crate::{Error, Result, read_ron_text, text::ron_text};

/// What was captured: `survey.ron`. Angles in radian, lengths of the camera in millimetre, times in second.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Survey {
    /// The camera, nominal; a calibration replaces what it has estimated.
    pub camera: SurveyCamera,
    /// What the frames hold.
    pub level: Level,
    /// The frames in the order of capture; empty where only tables are given.
    pub frames: Vec<FrameEntry>,
    /// Which camera it was: maker, model and serial number, as it should stand on a certificate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera_identity: Option<String>,
    /// Version of the camera's firmware.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub firmware: Option<String>,
    /// Who took the frames.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub operator: Option<String>,
    /// How depths stored as integers are to be read; needed for PNG and Matroska.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth: Option<StoredDepth>,
    /// When the camera was switched on, on the clock of the frames' `timestamp_s`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub power_on_s: Option<f64>,
    /// Frame rates since power-on, where the frames are no stream that shows them: a drift may follow them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub frame_rates: Vec<FrameRate>,
    /// A part of the image that shows light over a known path inside the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference_path: Option<ReferencePath>,
    /// Files with the truth of a simulation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub truth: Option<TruthFiles>,
    /// Further files by name, such as `observations` or `mesh`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub extras: BTreeMap<String, PathBuf>,
}

/// What the frames of a survey hold, from the rawest to the most processed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// Raw correlation samples.
    Samples,
    /// Phase and amplitude.
    Phase,
    /// Radial range.
    Range,
    /// Depth along the viewing axis.
    Depth,
    /// Light alone: images of a passive camera, or a range camera's grey images without their ranges.
    Intensity,
}

impl Level {
    /// The level's name in files, which is also the name of its principal array.
    pub fn name(self) -> &'static str {
        match self {
            Self::Samples => "samples",
            Self::Phase => "phase",
            Self::Range => "range",
            Self::Depth => "depth",
            Self::Intensity => "intensity",
        }
    }
}

/// One frame of a survey.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrameEntry {
    /// File relative to the survey's folder: `.npz`, `.npy`, `.png`, `.jpg` (of light alone), or `.mkv` where `#3` at
    /// the end picks the frame after the first three.
    pub file: PathBuf,
    /// Station the frame was taken from.
    pub station: String,
    /// Time of capture.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub timestamp_s: Option<f64>,
    /// Integration time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub integration_time_s: Option<f64>,
    /// Temperature of the camera in degrees Celsius.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature_c: Option<f64>,
}

/// A frame rate that holds until the next one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrameRate {
    /// From when on, on the clock of the frames' `timestamp_s`.
    pub since_s: f64,
    /// Frames a second; 0 for a camera that is on and takes none.
    pub rate_hz: f64,
}

/// How depths stored as integers are read: `depth_m = scale_m * stored`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StoredDepth {
    /// Metres of one stored unit.
    pub scale_m: f64,
    /// Stored value or values that mean "no depth": `0` or `[0, 65535]`.
    #[serde(deserialize_with = "validate::one_or_more", serialize_with = "validate::one_or_list")]
    pub invalid: Vec<u16>,
}

/// An optical reference (Sect. 4.7): pixels that see, through a fibre inside the camera, a path that does not change.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReferencePath {
    /// First and last column of the pixels.
    pub columns: [usize; 2],
    /// First and last row of the pixels.
    pub rows: [usize; 2],
    /// Length of the path as a range: half the way of the light.
    pub length_m: f64,
}

/// Files that hold the truth of a simulated survey.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TruthFiles {
    /// True poses, as `stations.csv`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stations: Option<PathBuf>,
    /// True parameters, as `calibration.ron`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calibration: Option<PathBuf>,
    /// `.npz` with `range`, `wraps`, `mixed` for each frame, in the order of the frames; or none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub frames: Vec<PathBuf>,
}

impl Survey {
    /// Name of the file in a survey's folder.
    pub const FILE_NAME: &str = "survey.ron";

    /// A survey of a camera and its frames, without any of the optional fields.
    pub fn new(camera: SurveyCamera, level: Level, frames: Vec<FrameEntry>) -> Self {
        Self {
            camera,
            level,
            frames,
            camera_identity: None,
            firmware: None,
            operator: None,
            depth: None,
            power_on_s: None,
            frame_rates: Vec::new(),
            reference_path: None,
            truth: None,
            extras: BTreeMap::new(),
        }
    }

    /// Reads and checks a `survey.ron`, given by its own path or by its folder's. A folder without one may be of TUM
    /// RGB-D (`depth.txt`) or of 7-Scenes (`frame-000000.depth.png`); `camera-intrinsics.txt` in it, the camera's matrix
    /// in pixels, replaces the focal length published for these.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let file = if path.is_dir() { path.join(Self::FILE_NAME) } else { path.to_path_buf() };
        if path.is_dir() && !file.exists() {
            #[cfg(feature = "png16")]
            if let Some(survey) = sequence::read_sequence(path)? {
                return Ok(survey);
            }
            let reason = "holds no survey.ron, and no depth images of names that are known (depth.txt, frame-000000.depth.png): name its files in a survey.ron";
            return Err(Error::format(path, reason));
        }
        Self::parse(&file, &read_ron_text(&file)?)
    }

    /// Reads and checks the text of a `survey.ron`; `file` stands for it in messages.
    ///
    /// # Errors
    /// [`Error::Format`](crate::Error::Format) and its kin, with file, line, column and the name of the field.
    ///
    /// ```
    /// use range_io::survey::Survey;
    ///
    /// let text = |frequency: &str| format!(r#"#![enable(implicit_some)]
    /// (
    ///     camera: (
    ///         width: 176, height: 144, pixel_pitch_mm: (0.04, 0.04),
    ///         principal_distance_mm: 8.0, principal_point_mm: (0.0, 0.0),
    ///         modulation_hz: [{frequency}], phase_steps: 4,
    ///     ),
    ///     level: samples,
    ///     frames: [(file: "frames/000_0.npz", station: "S00", integration_time_s: 0.002)],
    /// )"#);
    /// let survey = Survey::parse("survey.ron".as_ref(), &text("20e6"))?;
    /// assert_eq!(survey.camera.modulations()?[0].frequency_hz(), 20e6);
    ///
    /// let refused = Survey::parse("survey.ron".as_ref(), &text("0"));
    /// assert!(refused.unwrap_err().to_string().starts_with("survey.ron:6:"));
    /// # Ok::<(), range_io::Error>(())
    /// ```
    pub fn parse(file: &Path, text: &str) -> Result<Self> {
        let survey: Self = ron_text::parse(file, text)?;
        survey.check().map_err(|invalid| ron_text::at_field(file, text, invalid))?;
        Ok(survey)
    }

    /// Checks what the types do not: sizes, signs, and that the level has what it needs.
    pub fn validate(&self) -> Result<()> {
        self.check().map_err(|invalid| invalid.in_memory("survey"))
    }

    /// Checks and writes a `survey.ron`.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<()> {
        self.validate()?;
        Ok(atomic_output::write_text(path, &ron_text::to_text(self)?)?)
    }
}
