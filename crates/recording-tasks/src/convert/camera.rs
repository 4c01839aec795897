//! The camera of a stream of images: from a `calibration.ron`, from a recording's own words, or from the factory calibration of
//! an Azure Kinect.

use std::path::Path;

use camera_model::{Camera, LensDistortion, PlumbBob, Rational};
use commands::range_io::azure::{self, DepthMode, RationalIntrinsics};
use commands::range_io::calibration::Calibration;
use commands::range_io::error_models::ModelSet;
use commands::{Error, Result};
use recordings::CameraInfo;

use super::scan::{Scan, Scanned};
use super::{CameraUsed, ConvertRequest, refused};

/// Any will do: neither depths nor rays depend on the size of the pixels, which recordings do not tell.
const PITCH_MM: f64 = 0.01;

/// What a fit of a lens gives.
type Fit = std::result::Result<(Camera, f64), camera_model::Error>;

/// A camera, and what is written of it beside the survey.
pub(super) struct Found {
    pub camera: Camera,
    pub used: CameraUsed,
    /// The calibration to be written: `None` for a camera without distortion.
    pub calibration: Option<Calibration>,
}

/// The camera of the images of a stream.
pub(super) fn of_stream(request: &ConvertRequest, scan: &Scan, stream: usize) -> Result<Found> {
    let Scanned { name, image, .. } = &scan.streams[stream];
    let ([width, height], frame_id) = image.as_ref().map_or(([0, 0], ""), |(size, frame_id)| (*size, frame_id));
    if let Some(file) = &request.calibration {
        return of_file(file, [width, height]);
    }
    if let Some((source, info)) = matching(scan, name, frame_id, [width, height]) {
        return of_info(source, info, name);
    }
    if let Some(intrinsics) = factory(scan, [width, height])? {
        let used = (String::from("calibration.json"), String::from("rational_polynomial"));
        return fitted(used, Camera::from_rational(&rational(&intrinsics), PITCH_MM));
    }
    let reason = format!("tells no camera of stream `{name}` with {width} x {height} pixels");
    Err(refused(format!("the recording {reason}: name a calibration.ron with --calibration")))
}

fn of_file(file: &Path, size: [usize; 2]) -> Result<Found> {
    let calibration = Calibration::read(file)?;
    let found = [calibration.camera.width, calibration.camera.height];
    if found != size {
        let words = format!("is of {} x {} pixels, the images have {} x {}", found[0], found[1], size[0], size[1]);
        return Err(Error::Incompatible(format!("{} {words}", file.display())));
    }
    let used = CameraUsed { source: file.display().to_string(), model: "calibration".to_owned(), residual_px: 0.0 };
    Ok(Found { camera: calibration.camera()?, used, calibration: Some(calibration) })
}

/// The camera that stands beside the images, has their coordinate system, or is the only one of their size.
fn matching<'a>(scan: &'a Scan, name: &str, frame_id: &str, size: [usize; 2]) -> Option<(&'a str, &'a CameraInfo)> {
    let fits = |info: &CameraInfo| image_size(info) == size;
    let fitting: Vec<_> = scan.cameras.iter().filter(|(_, info)| fits(info)).collect();
    let parent = |topic: &str| topic.rsplit_once('/').map(|(parent, _)| parent.to_owned());
    let beside = fitting
        .iter()
        .find(|(stream, _)| parent(&scan.streams[*stream].name) == parent(name) && parent(name).is_some());
    let same_system = || fitting.iter().find(|(_, info)| !frame_id.is_empty() && info.frame_id == frame_id);
    let only = || fitting.first().filter(|_| fitting.len() == 1);
    let (stream, info) = beside.or_else(same_system).or_else(only)?;
    Some((&scan.streams[*stream].name, info))
}

/// Columns and rows of the images that a camera's words are of.
fn image_size(info: &CameraInfo) -> [usize; 2] {
    let [_, _, rows, columns] = info.window;
    if rows > 0 && columns > 0 {
        [columns as usize, rows as usize]
    } else {
        [info.width as usize, info.height as usize]
    }
}

fn of_info(source: &str, info: &CameraInfo, images: &str) -> Result<Found> {
    let wrong =
        |words: String| refused(format!("the camera of `{source}` {words}; name a calibration.ron with --calibration"));
    if info.binning.iter().any(|binning| *binning > 1) {
        return Err(wrong(format!("is of pixels binned by {:?}, which is not read", info.binning)));
    }
    let [width, height] = image_size(info);
    // Images that were rectified have the projection's pixels and no distortion left.
    let last = images.rsplit('/').next().unwrap_or_default();
    let is_rectified = last.starts_with("image_rect") && info.projection[0] > 0.0;
    let [fx, _, cx, _, fy, cy, ..] = info.matrix;
    let [fx, fy, cx, cy] = if is_rectified {
        [info.projection[0], info.projection[5], info.projection[2], info.projection[6]]
    } else {
        [fx, fy, cx, cy]
    };
    if fx <= 0.0 || fy <= 0.0 {
        return Err(wrong(format!("has focal lengths of {fx} and {fy} px: it is not calibrated")));
    }
    let [column, row, ..] = info.window.map(f64::from);
    let pinhole =
        PlumbBob { fx, fy, cx: cx - column, cy: cy - row, k1: 0.0, k2: 0.0, p1: 0.0, p2: 0.0, k3: 0.0, width, height };
    let used = |model: &str| (source.to_owned(), model.to_owned());
    let lens = info.distortion.as_slice();
    if is_rectified || lens.iter().all(|value| value.abs() <= 0.0) {
        let model = if is_rectified { "rectified" } else { "no distortion" };
        return without_lens(used(model), &pinhole);
    }
    match (info.distortion_model.as_str(), lens) {
        ("plumb_bob" | "", &[k1, k2, p1, p2, ref rest @ ..]) if rest.len() <= 1 => {
            let model = PlumbBob { k1, k2, p1, p2, k3: rest.first().copied().unwrap_or(0.0), ..pinhole };
            fitted(used("plumb_bob"), Camera::from_plumb_bob(&model, PITCH_MM))
        }
        ("rational_polynomial", &[k1, k2, p1, p2, k3, k4, k5, k6, ref rest @ ..])
            if rest.iter().all(|value| value.abs() <= 0.0) =>
        {
            let model = Rational { numerator: PlumbBob { k1, k2, p1, p2, k3, ..pinhole }, denominator: [k4, k5, k6] };
            fitted(used("rational_polynomial"), Camera::from_rational(&model, PITCH_MM))
        }
        (model, lens) => {
            Err(wrong(format!("has the lens model `{model}` with {} coefficients, which is not read", lens.len())))
        }
    }
}

/// A camera with the lens that was fitted to the recording's.
fn fitted((source, model): (String, String), fit: Fit) -> Result<Found> {
    let (camera, residual_px) = fit.map_err(|error| Error::Camera(error.to_string()))?;
    let mut calibration = Calibration::from_models(&camera, &ModelSet::default(), None)?;
    calibration.provenance.method = format!("lens fitted to that of {source} ({model}), within {residual_px:.3} px");
    Ok(Found { camera, used: CameraUsed { source, model, residual_px }, calibration: Some(calibration) })
}

/// A camera without distortion: `survey.ron` says all of it.
fn without_lens((source, model): (String, String), pinhole: &PlumbBob) -> Result<Found> {
    let (camera, _) = Camera::from_plumb_bob(pinhole, PITCH_MM).map_err(|error| Error::Camera(error.to_string()))?;
    // What the fit finds there is rounding.
    let camera = Camera { lens: LensDistortion::default(), ..camera };
    Ok(Found { camera, used: CameraUsed { source, model, residual_px: 0.0 }, calibration: None })
}

/// The factory calibration of an Azure Kinect for depth images of this size.
pub(super) fn factory(scan: &Scan, size: [usize; 2]) -> Result<Option<RationalIntrinsics>> {
    let mode = match size {
        [320, 288] => DepthMode::NarrowBinned,
        [640, 576] => DepthMode::NarrowUnbinned,
        [512, 512] => DepthMode::WideBinned,
        [1024, 1024] => DepthMode::WideUnbinned,
        _ => return Ok(None),
    };
    let Some(data) = &scan.factory else { return Ok(None) };
    let text = String::from_utf8_lossy(data);
    Ok(Some(azure::parse("calibration.json".as_ref(), &text, mode)?))
}

fn rational(found: &RationalIntrinsics) -> Rational {
    let [k1, k2, k3, k4, k5, k6] = found.radial;
    let [p1, p2] = found.decentring;
    let ([fx, fy], [cx, cy]) = (found.focal_px, found.principal_point_px);
    let numerator = PlumbBob { fx, fy, cx, cy, k1, k2, p1, p2, k3, width: found.width, height: found.height };
    Rational { numerator, denominator: [k4, k5, k6] }
}

/// The same in ROS's words.
pub(super) fn info_of(found: &RationalIntrinsics, frame_id: &str) -> CameraInfo {
    let [k1, k2, k3, k4, k5, k6] = found.radial;
    let [p1, p2] = found.decentring;
    let matrix = (found.focal_px, found.principal_point_px);
    let size = [found.width, found.height];
    super::ros::camera_info(frame_id, size, matrix, "rational_polynomial", vec![k1, k2, p1, p2, k3, k4, k5, k6])
}
