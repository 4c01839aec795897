//! The cloud of a result, with what is known of its errors.

use std::path::Path;

use camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion};
use commands::Result;
use common_errors::{CommonErrorsFile, FrameErrors};
use error_models::{AmplitudeScale, RangeErrorModel};
use measurement::Cloud;
use nalgebra::{DMatrix, Isometry3, Matrix3, Point3, Vector3, Vector4};
use point_uncertainty::{CommonError, CommonErrors, PointErrors, SharedErrorGrid, Source, StationErrors};
use range_io::calibration::Calibration;
use range_io::clouds::CloudFile;
use range_io::ply::read_cloud;
use range_io::ron_text;

use crate::fused_result::fused_from;
use crate::plan::request;
use crate::seen::fits_its_frames;

/// The cloud's file in a result.
pub(crate) const CLOUD: &str = "cloud.ply";
const TILES: &str = "cloud.copc.laz";
/// The file of its common errors.
const COMMON_ERRORS: &str = CommonErrorsFile::FILE_NAME;
/// A result's cloud.
pub(crate) struct ResultCloud {
    pub(crate) points: Vec<Point3<f64>>,
    pub(crate) errors: ErrorsOfCloud,
    pub(crate) common: CommonErrors,
    /// Points that are measured with: those without a flag.
    pub(crate) usable: Vec<usize>,
    /// Whether there is a file of common errors.
    pub(crate) has_common: bool,
    /// Where there is none, the folder of the result that this cloud was fused from, if it was.
    pub(crate) fused_from: Option<String>,
    /// Calibration that it names.
    pub(crate) calibration: Option<String>,
    /// What the common errors leave out, in words.
    pub(crate) not_in_it: Vec<String>,
    /// Names of the frames, as the common errors count them.
    pub(crate) views: Vec<String>,
    /// Names of the stations that the frames are of.
    pub(crate) station_names: Vec<String>,
    /// Flags of the points, where the cloud has them.
    pub(crate) flags: Option<Vec<u16>>,
    /// The image of a camera whose frames share an error that no calibration has: its depths come from a pattern or from two images.
    depth_image: Option<ImageFormat>,
    /// Whether it is known what the cameras see.
    pub(crate) has_camera: bool,
}

/// What each point has for itself, and how it moves.
pub(crate) struct ErrorsOfCloud {
    points: Vec<Point3<f64>>,
    pub(crate) sigma: Option<Vec<f32>>,
    covariance: Option<Vec<[f32; 6]>>,
    pub(crate) intensity: Option<Vec<f32>>,
    pub(crate) frame: Vec<u32>,
    pub(crate) stations: Vec<StationErrors>,
}

impl ResultCloud {
    /// Reads the cloud of a result, and its common errors where there are any.
    pub(crate) fn read(folder: &Path) -> Result<Self> {
        let path = folder.join(CLOUD);
        if !path.exists() && !folder.join(TILES).exists() {
            let folder = folder.display();
            return Err(request(format!("{folder}: is no result of `rangecam run`, which has a {CLOUD}")));
        }
        if !path.exists() {
            return Err(request(format!(
                "{}: its points are in tiles ({TILES}), which are for viewers: run the pipeline again on the part that matters, or with \
                 a larger --tiles-above",
                folder.display()
            )));
        }
        let file = read_cloud(&path)?.in_world();
        let has_sigma = file.sigma.as_ref().is_some_and(|sigma| sigma.iter().any(|sigma| sigma.is_finite()));
        if !has_sigma && file.covariance.is_none() {
            return Err(request(format!(
                "{}: no point has a `sigma` or a covariance, so nothing is known of its noise: run the pipeline again with a calibration \
                 that has `range_noise`, which `rangecam noise` finds from frames of a scene at rest",
                path.display()
            )));
        }
        let errors_path = folder.join(COMMON_ERRORS);
        if !errors_path.exists() {
            let alone = Self::new(file, Vec::new(), CommonErrors::none(), None);
            return Ok(Self { fused_from: fused_from(folder), ..alone });
        }
        let errors: CommonErrorsFile = ron_text::read(&errors_path)?;
        let wrong = |message: String| request(format!("{}: {message}", errors_path.display()));
        let common = common(&errors).map_err(wrong)?;
        let (stations, depth_image) = stations(&errors, folder, &wrong)?;
        let Some(frame) = &file.frame else {
            return Err(request(format!(
                "{}: its points name no `frame`, which {COMMON_ERRORS} needs",
                path.display()
            )));
        };
        if let Some(point) = frame.iter().position(|frame| *frame as usize >= stations.len()) {
            let frames = stations.len();
            return Err(wrong(format!("point {point} of the cloud is of frame {}, there are {frames}", frame[point])));
        }
        let not_in_it = errors.not_in_it;
        let (views, station_names) = errors.frames.into_iter().map(|frame| (frame.view, frame.station)).unzip();
        let has_camera = errors.calibration.is_some();
        let alone = Self::new(file, stations, common, errors.calibration);
        let read = Self { not_in_it, views, station_names, depth_image, has_camera, ..alone };
        fits_its_frames(&read).map_err(|wrong| request(format!("{}: {wrong}", path.display())))?;
        Ok(read)
    }

    fn new(file: CloudFile, stations: Vec<StationErrors>, common: CommonErrors, calibration: Option<String>) -> Self {
        let points: Vec<Point3<f64>> = file.points.iter().map(|point| Point3::from(*point)).collect();
        let flag = |point: &usize| file.flags.as_ref().map_or(0, |flags| flags[*point]);
        Self {
            usable: (0..points.len()).filter(|point| flag(point) == 0).collect(),
            has_common: !stations.is_empty(),
            fused_from: None,
            errors: ErrorsOfCloud {
                points: points.clone(),
                sigma: file.sigma,
                covariance: file.covariance,
                intensity: file.intensity,
                frame: file.frame.unwrap_or_default(),
                stations,
            },
            points,
            common,
            calibration,
            not_in_it: Vec::new(),
            views: Vec::new(),
            station_names: Vec::new(),
            flags: file.flags,
            depth_image: None,
            has_camera: false,
        }
    }

    /// Makes the error that all frames of a depth camera share one of the common errors, where the camera is of that kind. How large it is
    /// is not known here.
    pub(crate) fn share_error(&mut self) -> Result<Option<SharedErrorGrid>> {
        let Some(format) = self.depth_image else { return Ok(None) };
        let before = self.common.errors().len();
        let grid = SharedErrorGrid::new(before, &format);
        let [across, down] = grid.nodes();
        let node = |at: usize| CommonError {
            name: format!("shared error, node {} {}", at % across, at / across),
            source: Source::Calibration,
        };
        let errors: Vec<CommonError> =
            self.common.errors().iter().cloned().chain((0..across * down).map(node)).collect();
        let mut covariance = DMatrix::zeros(errors.len(), errors.len());
        covariance.view_mut((0, 0), (before, before)).copy_from(self.common.covariance());
        let count = errors.len();
        self.common = CommonErrors::new(errors, covariance).map_err(|error| request(error.to_string()))?;
        let with = |station: StationErrors| station.with_shared_error(grid, count);
        let stations: std::result::Result<Vec<_>, _> =
            std::mem::take(&mut self.errors.stations).into_iter().map(with).collect();
        self.errors.stations = stations.map_err(|error| request(error.to_string()))?;
        Ok(Some(grid))
    }

    pub(crate) fn cloud(&self) -> Cloud<'_> {
        Cloud { points: &self.points, errors: &self.errors, common: &self.common }
    }
}

impl ErrorsOfCloud {
    pub(crate) fn amplitude(&self, point: usize) -> f64 {
        self.intensity.as_ref().map_or(f64::NAN, |all| f64::from(all[point]))
    }

    fn sigma_m(&self, point: usize) -> f64 {
        self.sigma.as_ref().map_or(f64::NAN, |all| f64::from(all[point]))
    }

    fn station(&self, point: usize) -> Option<&StationErrors> {
        self.stations.get(*self.frame.get(point)? as usize)
    }
}

impl PointErrors for ErrorsOfCloud {
    /// Without a known ray, a standard deviation counts in all directions.
    fn noise(&self, point: usize) -> Matrix3<f64> {
        if let Some([xx, xy, xz, yy, yz, zz]) = self.covariance.as_ref().map(|all| all[point].map(f64::from)) {
            let own = self.station(point).map_or(1.0, StationErrors::own_share);
            return Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) * own;
        }
        let sigma_m = self.sigma_m(point);
        match self.station(point) {
            Some(station) => station.noise(&self.points[point], sigma_m),
            None => Matrix3::identity() * (sigma_m * sigma_m),
        }
    }

    fn sensor(&self, point: usize) -> Option<(u64, Vector3<f64>)> {
        let station = self.station(point)?;
        // Of a covariance, what lies along the ray.
        let sigma_m = self.covariance.as_ref().map_or_else(
            || self.sigma_m(point),
            |all| {
                let [xx, xy, xz, yy, yz, zz] = all[point].map(f64::from);
                let ray = station.ray(&self.points[point]);
                ray.dot(&(Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) * ray)).max(0.0).sqrt()
            },
        );
        station.sensor(&self.points[point], sigma_m)
    }

    fn common(&self, point: usize, derivatives: &mut Vec<(usize, Vector3<f64>)>) {
        if let Some(station) = self.station(point) {
            station.common(&self.points[point], self.amplitude(point), derivatives);
        }
    }
}

fn common(file: &CommonErrorsFile) -> std::result::Result<CommonErrors, String> {
    if file.format_version != CommonErrorsFile::FORMAT_VERSION {
        let (found, expected) = (file.format_version, CommonErrorsFile::FORMAT_VERSION);
        return Err(format!("`format_version` is {found}, expected {expected}"));
    }
    if file.frames.is_empty() {
        return Err("`frames` is empty: expected those that the cloud counts".to_owned());
    }
    let size = file.errors.len();
    let odd = file.covariance.iter().enumerate().find(|(row, values)| values.len() != row + 1);
    if let Some((row, values)) = odd {
        return Err(format!("`covariance[{row}]` has {} values, expected {}", values.len(), row + 1));
    }
    if file.covariance.len() != size {
        return Err(format!("`covariance` has {} rows for {size} errors", file.covariance.len()));
    }
    file.common().map_err(|error| error.to_string())
}

/// The stations, and the image of a depth camera without amplitudes.
fn stations(
    file: &CommonErrorsFile,
    folder: &Path,
    wrong: &dyn Fn(String) -> commands::Error,
) -> Result<(Vec<StationErrors>, Option<ImageFormat>)> {
    let calibration = match &file.calibration {
        Some(name) => Some(Calibration::read(folder.join(name))?),
        None => None,
    };
    let camera = match &calibration {
        Some(calibration) => calibration.camera()?,
        None => any_camera().map_err(|error| wrong(error.to_string()))?,
    };
    let mut stations = Vec::with_capacity(file.frames.len());
    for (number, frame) in file.frames.iter().enumerate() {
        let at = |reason: String| wrong(format!("frames[{number}] ({}): {reason}", frame.view));
        let found = station(file, number, frame, calibration.as_ref(), &camera).map_err(at)?;
        stations.push(found);
    }
    let noise = calibration.as_ref().and_then(|calibration| calibration.range_noise);
    let is_depth_camera = noise.is_some_and(|noise| noise.amplitude_scale == AmplitudeScale::InverseSquaredRange);
    Ok((stations, is_depth_camera.then_some(camera.format)))
}

fn station(
    file: &CommonErrorsFile,
    number: usize,
    frame: &FrameErrors,
    calibration: Option<&Calibration>,
    camera: &Camera,
) -> std::result::Result<StationErrors, String> {
    let needs_camera = !frame.columns.camera.is_empty() || !frame.columns.range.is_empty() || frame.sensor.is_some();
    if calibration.is_none() && needs_camera {
        return Err("it has errors of camera, range terms or pixels, but `calibration` names no file".to_owned());
    }
    let models = calibration.map_or(&[][..], |calibration| &calibration.range_models);
    let model: Option<RangeErrorModel> = match frame.range_model {
        Some(index) => {
            let stated = models.get(index);
            let missing = || format!("`range_model` is {index}, the calibration has {}", models.len());
            Some(stated.ok_or_else(missing)?.to_model().map_err(|error| error.to_string())?)
        }
        None if !frame.columns.range.is_empty() => {
            return Err("its `columns` have range terms, but it names no `range_model`".to_owned());
        }
        None => None,
    };
    let world_from_camera = pose(frame)?;
    let columns = frame.columns.clone();
    let found =
        StationErrors::new(number as u32, camera, model.as_ref(), &world_from_camera, columns, file.errors.len());
    let found = match frame.sensor {
        Some(sensor) => found.and_then(|found| found.with_sensor(sensor)),
        None => found,
    };
    found.map_err(|error| error.to_string())
}

/// Largest deviation of a quaternion's length from one: files round to six digits.
const UNIT_LENGTH: f64 = 1e-4;

fn pose(frame: &FrameErrors) -> std::result::Result<Isometry3<f64>, String> {
    let length = Vector4::from(frame.quaternion_xyzw).norm();
    let off = (length - 1.0).abs();
    if off.is_nan() || off > UNIT_LENGTH {
        return Err(format!("`quaternion_xyzw` has length {length}, expected 1"));
    }
    if let Some(value) = frame.position_m.iter().find(|value| !value.is_finite()) {
        return Err(format!("`position_m` has {value}, expected finite coordinates"));
    }
    Ok(frame.world_from_camera())
}

/// A camera that sees all that is before it, for frames of which only poses and drifts err: no image enters these.
fn any_camera() -> std::result::Result<Camera, camera_model::Error> {
    let format = ImageFormat::new(1024, 1024, [0.01, 0.01])?;
    let interior = InteriorOrientation { principal_point_mm: [0.0; 2], principal_distance_mm: 5.0 };
    Camera::new(format, interior, LensDistortion::default())
}
