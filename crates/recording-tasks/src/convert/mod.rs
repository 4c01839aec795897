//! Recordings to surveys and MCAP, and surveys to MCAP.

mod camera;
mod frames;
mod imu;
mod ros;
mod scan;
mod summary;
mod survey_to_mcap;
mod to_mcap;
mod to_survey;
mod topics;

use std::path::{Path, PathBuf};

use commands::range_io::survey::Level;
use commands::{Error, Inputs, Progress, Result, root_of};

use crate::is_recording;
pub use summary::{CameraUsed, ConvertSummary, ImuUsed, Skipped};

/// What is to be converted, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct ConvertRequest {
    /// A recording, or a survey's folder.
    pub input: PathBuf,
    /// A folder for a survey; a file that ends in `.mcap` for MCAP.
    pub out: PathBuf,
    /// The stream of a recording whose images become frames; `None`: the only one of depths or ranges.
    pub stream: Option<String>,
    /// What its values are: `Depth`, `Range` or `Intensity`; `None`: what the recording says.
    pub level: Option<Level>,
    /// The stream of inertial samples; `None`: the only one.
    pub imu: Option<String>,
    /// A `calibration.ron` whose camera is taken in place of the recording's.
    pub calibration: Option<PathBuf>,
    /// One station for all frames; `None`: each frame is a station of its own.
    pub station: Option<String>,
}

impl ConvertRequest {
    /// A request without options.
    pub fn new(input: impl Into<PathBuf>, out: impl Into<PathBuf>) -> Self {
        Self {
            input: input.into(),
            out: out.into(),
            stream: None,
            level: None,
            imu: None,
            calibration: None,
            station: None,
        }
    }
}

/// Converts a recording to a survey or to MCAP, or a survey to MCAP: frame by frame, with their times.
///
/// # Errors
/// [`Error::Request`] for what is no recording, has no stream of the kind that is asked for, several of them, or no camera;
/// [`Error::File`] and [`Error::Access`] for files.
pub fn convert(request: &ConvertRequest, progress: &dyn Progress) -> Result<ConvertSummary> {
    let to_mcap = request.out.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("mcap"));
    match (is_recording(&request.input), to_mcap) {
        (true, false) => to_survey::convert(request, progress),
        (true, true) => to_mcap::convert(request, progress),
        (false, true) if is_survey(&request.input) => survey_to_mcap::convert(request, progress),
        (false, false) if is_survey(&request.input) => {
            let out = request.out.display();
            Err(refused(format!("a survey becomes MCAP: {out} does not end in .mcap")))
        }
        (false, _) => {
            let input = request.input.display();
            Err(refused(format!(
                "{input} is neither a recording (MCAP, ROS 1 bag, Azure Kinect .mkv, ADI .bin) nor a survey"
            )))
        }
    }
}

fn is_survey(path: &Path) -> bool {
    path.is_dir() || path.file_name().is_some_and(|name| name == range_io::survey::Survey::FILE_NAME)
}

/// What is wrong with a request.
fn refused(message: impl Into<String>) -> Error {
    Error::Request { command: "convert", message: message.into() }
}

/// Refuses an output file that is, or lies in, something that is read.
fn check_file(request: &ConvertRequest) -> Result<()> {
    let file = &request.out;
    let is_survey = request.input.is_dir() || !is_recording(&request.input);
    let read = if is_survey { root_of(&request.input) } else { request.input.clone() };
    let place = |path: &Path| std::fs::canonicalize(path);
    let parent = file.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let beside = place(parent).map(|parent| parent.join(file.file_name().unwrap_or_default()));
    // A link leads to what it would be written over.
    for place_of_file in [place(file), beside].into_iter().flatten() {
        if [Some(&read), request.calibration.as_ref()]
            .into_iter()
            .flatten()
            .any(|input| place(input).is_ok_and(|input| place_of_file.starts_with(input)))
        {
            let (file, read) = (file.display(), read.display());
            return Err(refused(format!("{file} cannot be the output file: it is, or lies in, {read}, which is read")));
        }
    }
    let inputs = Inputs::default().maybe(request.calibration.as_deref());
    let inputs = if is_survey { inputs.survey(&request.input) } else { inputs.path(&request.input) };
    // A survey may name frames outside of its folder.
    if file.exists() { Ok(()) } else { inputs.destination(file).map(drop) }
}
