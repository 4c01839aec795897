//! Folders of depth images that come without a `survey.ron`: TUM RGB-D and 7-Scenes.

use std::path::{Path, PathBuf};

use super::{FrameEntry, Level, StoredDepth, Survey, SurveyCamera};
use crate::read_text;
use crate::{Error, Result, formats::images::png16};

/// Name of the file with the camera's matrix, three rows of three numbers (pixel).
const INTRINSICS: &str = "camera-intrinsics.txt";
const DEPTH_LIST: &str = "depth.txt";
const DEPTH_IMAGE: &str = ".depth.png";
/// Any will do: the depths do not depend on the size of the pixels.
const PITCH_MM: f64 = 0.01;

/// What a kind of folder says of its images without writing it into a file.
struct Kind {
    depth: StoredDepth,
    /// Focal length (pixel) and principal point (column, row) that its publishers state for images of 640 x 480.
    published: [f64; 4],
    entries: Vec<FrameEntry>,
}

/// The survey that a folder of one of these kinds stands for; `None` where it is of neither.
pub(super) fn read_sequence(folder: &Path) -> Result<Option<Survey>> {
    let list = folder.join(DEPTH_LIST);
    let kind = if list.is_file() { Some(tum(&list)?) } else { seven_scenes(folder)? };
    let Some(Kind { depth, published, entries }) = kind else { return Ok(None) };
    let Some(first) = entries.first() else {
        return Err(Error::format(
            &list,
            "lists no image, expected lines such as `1305031102.16 depth/1305031102.16.png`",
        ));
    };
    let image = png16::read(folder.join(&first.file))?;
    let camera = camera(folder, [image.width(), image.height()], published)?;
    let survey = Survey { depth: Some(depth), ..Survey::new(camera, Level::Depth, entries) };
    survey.validate()?;
    Ok(Some(survey))
}

/// `depth.txt` with a time in seconds and a file in each line; 5000 units of the images are a metre.
fn tum(list: &Path) -> Result<Kind> {
    let text = read_text(list)?;
    let mut entries = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let wrong = |column: usize, field: &str, reason: &str| Error::Text {
            file: list.to_path_buf(),
            line: index + 1,
            column,
            field: field.to_owned(),
            reason: reason.to_owned(),
        };
        let (time, file) =
            line.split_once(char::is_whitespace).ok_or_else(|| wrong(2, "file", "is missing, expected `time file`"))?;
        let timestamp_s: Option<f64> = time.parse().ok().filter(|time: &f64| time.is_finite());
        let timestamp_s = timestamp_s.ok_or_else(|| wrong(1, "time", "is no finite number of seconds"))?;
        entries.push(entry(file.trim().into(), timestamp_s));
    }
    let depth = StoredDepth { scale_m: 1.0 / 5000.0, invalid: vec![0] };
    Ok(Kind { depth, published: [525.0, 525.0, 319.5, 239.5], entries })
}

/// `frame-000000.depth.png` and so on, in millimetre. The number in the name stands for the time, as for the poses of such folders.
fn seven_scenes(folder: &Path) -> Result<Option<Kind>> {
    let mut frames: Vec<(u64, PathBuf)> = Vec::new();
    for found in std::fs::read_dir(folder).map_err(Error::io(folder, "list the folder"))? {
        let name = PathBuf::from(found.map_err(Error::io(folder, "list the folder"))?.file_name());
        let text = name.to_string_lossy().into_owned();
        let Some(stem) = text.strip_suffix(DEPTH_IMAGE) else { continue };
        let digits = stem.trim_start_matches(|c: char| !c.is_ascii_digit());
        let number = digits.parse();
        let number = number.map_err(|_| Error::format(&folder.join(&name), "has no frame's number in its name"))?;
        frames.push((number, name));
    }
    frames.sort();
    let entries: Vec<FrameEntry> = frames.into_iter().map(|(number, file)| entry(file, number as f64)).collect();
    let depth = StoredDepth { scale_m: 1e-3, invalid: vec![0, u16::MAX] };
    Ok((!entries.is_empty()).then_some(Kind { depth, published: [585.0, 585.0, 320.0, 240.0], entries }))
}

/// Every image of a moving camera is a station of its own, named after its file.
fn entry(file: PathBuf, timestamp_s: f64) -> FrameEntry {
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    let station = name.strip_suffix(DEPTH_IMAGE).or_else(|| name.strip_suffix(".png")).unwrap_or(&name).to_owned();
    FrameEntry { station, file, timestamp_s: Some(timestamp_s), integration_time_s: None, temperature_c: None }
}

fn camera(folder: &Path, [width, height]: [usize; 2], published: [f64; 4]) -> Result<SurveyCamera> {
    let file = folder.join(INTRINSICS);
    let [fx, fy, column, row] = if file.is_file() {
        intrinsics(&file)?
    } else if [width, height] == [640, 480] {
        published
    } else {
        let reason = format!("is missing; images of {width} x {height} pixels have no published focal length");
        return Err(Error::format(&file, reason));
    };
    // A pixel as high as the focal lengths of the two directions ask for.
    let pitch = [PITCH_MM, PITCH_MM * fx / fy];
    let middle = |count: usize| (count as f64 - 1.0) / 2.0;
    Ok(SurveyCamera {
        width,
        height,
        pixel_pitch_mm: pitch,
        principal_distance_mm: PITCH_MM * fx,
        principal_point_mm: [(column - middle(width)) * pitch[0], (middle(height) - row) * pitch[1]],
        modulation_hz: Vec::new(),
        phase_steps: None,
        phase_sense: range_image::PhaseSense::default(),
        phase_offset_rad: 0.0,
        saturation: None,
        raw_scale: 1.0,
    })
}

/// Focal lengths and principal point of a matrix `fx 0 cx / 0 fy cy / 0 0 1`.
fn intrinsics(file: &Path) -> Result<[f64; 4]> {
    let text = read_text(file)?;
    let numbers: Vec<f64> = text.split_whitespace().map_while(|word| word.parse().ok()).collect();
    let words = text.split_whitespace().count();
    match numbers.as_slice() {
        &[fx, skew, column, c, fy, row, d, e, one] if words == 9 => {
            let rest = skew.abs() + c.abs() + d.abs() + e.abs() + (one - 1.0).abs();
            let sound = [fx, fy, column, row].iter().all(|x| x.is_finite()) && fx > 0.0 && fy > 0.0;
            if sound && rest < f64::EPSILON {
                return Ok([fx, fy, column, row]);
            }
            Err(Error::format(file, "is no matrix of a camera, expected fx 0 cx, 0 fy cy, 0 0 1 with positive fx, fy"))
        }
        _ => Err(Error::format(file, "holds something else than nine numbers, expected fx 0 cx, 0 fy cy, 0 0 1")),
    }
}
