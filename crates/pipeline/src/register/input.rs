//! Surveys and clouds as stations with points, normals and what is known of them.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use camera_model::{Camera, OrganisedCloud, RayTable};
use nalgebra::{Isometry3, Vector3};
use point_cloud::{Cloud, OrganisedNormalOptions, organised_normals};
use projective_registration::Projection;
use range_io::calibration::Calibration;
use range_io::clouds::{CloudFile, read_any_cloud};
use range_io::survey::{Level, Survey};
use statistics::quantile;

use super::RegisterRequest;
use crate::load::{read_calibration, root_of};
use crate::outcome::{Outcome, StationPose};
use crate::plan::{
    AverageOptions, CorrectImagePointOptions, CorrectRangeOptions, DeconvolveOptions, DemodulateOptions, FlagOptions,
    FuseExposuresOptions, PointCloudOptions, UnwrapOptions,
};
use crate::plausibility::{self, PlacedStation};
use crate::progress::Progress;
use crate::run::process;
use crate::stages::corrects_ranges;
use crate::verdict::Doubt;
use crate::{Error, Plan, Result, Stage};

/// Below this number of points there is no surface to speak of.
const FEWEST_POINTS: usize = 50;

/// Windows that the normals of a frame come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Windows {
    /// All of one size.
    Alike,
    /// Wider where noise hides the surface. Only with start poses: what these add is too dim to tell poses that are sought
    /// from the clouds alone (a small room with 1 % gross errors is not found from the order of its stations then).
    AsNoiseAsks,
}

impl Windows {
    /// How much wider windows become: four times as wide, 30 times as much noise.
    const WIDENED: usize = 4;

    /// Those that serve with start poses or without.
    pub(crate) fn of_start(has_poses: bool) -> Self {
        if has_poses { Self::AsNoiseAsks } else { Self::Alike }
    }

    fn widest(self, half_width_px: usize) -> Option<usize> {
        (self == Self::AsNoiseAsks).then(|| (Self::WIDENED * half_width_px).min(100))
    }
}

/// One cloud to register, in its own frame.
pub(crate) struct Station {
    pub(crate) name: String,
    pub(crate) timestamp_s: f64,
    /// All points with what the input says of them; what is written in the end.
    pub(crate) file: CloudFile,
    /// How points fall on its pixels, where it is the frame of a camera; the same for all stations.
    pub(crate) projection: Option<Arc<Projection>>,
    /// Where the input says it stands.
    pub(crate) approximate: Option<Isometry3<f64>>,
    /// Standard deviations of that position, metre, and attitude, radian, in space, where they are stated.
    pub(crate) approximate_sigma: [Option<f64>; 2],
    /// Where it truly stands, of simulated surveys.
    pub(crate) truth: Option<Isometry3<f64>>,
}

/// Everything that is to be registered.
pub(super) struct Input {
    /// At least two.
    pub(super) stations: Vec<Station>,
    /// Index of the axis of the common frame that points up, as far as one can tell.
    pub(super) vertical_axis: usize,
    /// What speaks against the frames.
    pub(super) doubts: Vec<Doubt>,
}

/// Reads what was named.
pub(super) fn read(request: &RegisterRequest, progress: &dyn Progress) -> Result<Input> {
    if let Some(missing) = request.inputs.iter().find(|path| !path.exists()) {
        return Err(request_error(format!("{}: there is no such file or folder", missing.display())));
    }
    match request.inputs.as_slice() {
        [] => Err(request_error("no input is named: name one survey folder, or two and more clouds".into())),
        [survey] if is_survey(survey) => survey_stations(survey, request, progress),
        [cloud] => Err(request_error(format!(
            "{} is one cloud: name a second one to be brought onto it, or a survey folder",
            cloud.display()
        ))),
        several => {
            if let Some(survey) = several.iter().find(|path| is_survey(path)) {
                return Err(request_error(format!(
                    "{} is a folder among several inputs: name one survey, or clouds only",
                    survey.display()
                )));
            }
            cloud_stations(several, progress)
        }
    }
}

fn request_error(message: String) -> Error {
    Error::Request { command: "register", message }
}

/// Whether the path is a folder with `survey.ron`, or that file.
pub(crate) fn is_survey(path: &Path) -> bool {
    path.is_dir() || path.file_name().is_some_and(|name| name == Survey::FILE_NAME)
}

fn survey_stations(path: &Path, request: &RegisterRequest, progress: &dyn Progress) -> Result<Input> {
    let survey = Survey::read(path)?;
    let first = survey.frames.first().map(|frame| &frame.station);
    if survey.frames.iter().all(|frame| Some(&frame.station) == first) {
        return Err(request_error(format!(
            "{}: all {} frames belong to one station, whose frames are averaged; at least two stations are needed",
            path.display(),
            survey.frames.len()
        )));
    }
    let (calibration, _) = read_calibration(&root_of(path), request.calibration.as_deref())?;
    let stages = stages(survey.level, calibration.as_ref());
    let plan = Plan { name: "register".to_owned(), source: None, calibrate: None, stages };
    let outcome = process(&plan, &root_of(path), request.calibration.as_deref(), progress)?;
    let mut doubts = outcome.doubts.clone();
    doubts.extend(plausibility::of_outcome(&outcome));
    Ok(Input { stations: Station::of_views(&outcome), vertical_axis: outcome.vertical_axis, doubts })
}

/// The way from the survey's level to flagged points, as far as the calibration has something to say.
pub(crate) fn stages(level: Level, calibration: Option<&Calibration>) -> Vec<Stage> {
    let mut stages = Vec::new();
    if level == Level::Samples {
        stages.push(Stage::Demodulate(DemodulateOptions::default()));
    }
    stages.push(Stage::Average(AverageOptions::default()));
    if matches!(level, Level::Samples | Level::Phase) {
        if calibration.is_some_and(|calibration| calibration.scattering.is_some()) {
            stages.push(Stage::Deconvolve(DeconvolveOptions::default()));
        }
        stages.push(Stage::Unwrap(UnwrapOptions::default()));
    }
    if let Some(calibration) = calibration {
        // A camera that corrects its ranges itself has a calibration of its lens alone.
        if corrects_ranges(calibration) {
            stages.push(Stage::CorrectRange(CorrectRangeOptions::default()));
        }
        stages.push(Stage::CorrectImagePoint(CorrectImagePointOptions::default()));
    }
    stages.push(Stage::FuseExposures(FuseExposuresOptions::default()));
    stages.push(Stage::PointCloud(PointCloudOptions::default()));
    stages.push(Stage::Flag(FlagOptions::default()));
    stages
}

/// The pixels of the camera; `None` for one too small to be registered by pixels.
pub(crate) fn projection(camera: &Camera) -> Option<Arc<Projection>> {
    let rays = RayTable::new(camera).ok()?;
    let format = &camera.format;
    Projection::from_directions(format.width, format.height, rays.directions()).ok().map(Arc::new)
}

fn cloud_stations(paths: &[PathBuf], progress: &dyn Progress) -> Result<Input> {
    progress.begin("read clouds", paths.len());
    let mut stations: Vec<Station> = Vec::with_capacity(paths.len());
    for (index, path) in paths.iter().enumerate() {
        let file = read_any_cloud(path)?;
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let taken = stations.iter().any(|station| station.name == stem);
        stations.push(Station {
            name: if taken { format!("{stem}-{index}") } else { stem },
            timestamp_s: index as f64,
            approximate: file.world_from_cloud,
            approximate_sigma: [None; 2],
            file,
            projection: None,
            truth: None,
        });
        progress.advance(index + 1);
    }
    let vertical_axis = flattest(&stations[0].file.points);
    Ok(Input { stations, vertical_axis, doubts: Vec::new() })
}

/// The axis along which the cloud is thinnest: up, where the cloud is of a landscape or of rooms.
fn flattest(points: &[[f64; 3]]) -> usize {
    let extent = |axis: usize| {
        let mut values: Vec<f64> = points.iter().map(|point| point[axis]).collect();
        quantile(&mut values, 0.99) - quantile(&mut values, 0.01)
    };
    let extents = [extent(0), extent(1), extent(2)];
    [2, 1, 0].into_iter().min_by(|&a, &b| extents[a].total_cmp(&extents[b])).unwrap_or(2)
}

impl Station {
    /// The views of a survey with their clouds.
    pub(crate) fn of_views(outcome: &Outcome) -> Vec<Self> {
        let projection = projection(&outcome.camera);
        let station = |(view, cloud): (&crate::View, &OrganisedCloud)| Self {
            name: view.station.clone(),
            timestamp_s: view.timestamp_s,
            file: CloudFile {
                points: cloud.points.clone(),
                intensity: Some(cloud.amplitude.clone()),
                sigma: Some(cloud.sigma.clone()),
                flags: Some(cloud.flags.iter().map(range_image::Flags::bits).collect()),
                size: Some([cloud.width, cloud.height]),
                ..CloudFile::default()
            },
            projection: projection.clone(),
            approximate: view.approximate_world_from_camera,
            approximate_sigma: plausibility::stated_sigma(&outcome.stated, &view.station),
            truth: view.truth.as_ref().and_then(|truth| truth.world_from_camera),
        };
        outcome.views.iter().zip(&outcome.clouds).map(station).collect()
    }

    /// All points of the file; NaN where a flag excludes one.
    pub(crate) fn usable_points(&self) -> Vec<[f64; 3]> {
        let usable = |index: usize| self.file.flags.as_ref().is_none_or(|flags| flags[index] == 0);
        let points = self.file.points.iter().enumerate();
        points.map(|(index, point)| if usable(index) { *point } else { [f64::NAN; 3] }).collect()
    }

    /// Median distance of the usable points from the origin of their frame, metre.
    fn distance_m(&self) -> f64 {
        let points = self.usable_points();
        let mut distances: Vec<f64> = points.iter().map(|[x, y, z]| x.hypot(*y).hypot(*z)).collect();
        quantile(&mut distances, 0.5)
    }

    /// The station with the pose that was found.
    pub(super) fn placed<'a>(&'a self, pose: &'a StationPose) -> PlacedStation<'a> {
        PlacedStation {
            name: &self.name,
            pose,
            stated: self.approximate,
            stated_sigma: self.approximate_sigma,
            distance_m: if self.is_seen_from_origin() { self.distance_m() } else { f64::NAN },
        }
    }

    /// Whether the points were seen from the origin of their frame, as those of cameras and scanners are.
    pub(super) fn is_seen_from_origin(&self) -> bool {
        self.projection.is_some() || self.file.size.is_some()
    }

    /// The usable points with normals, sigma and intensity. `normal_half_width_px`: of the windows that normals of a frame
    /// come from.
    pub(crate) fn cloud(&self, normal_half_width_px: usize, windows: Windows) -> Result<Cloud> {
        let points = self.usable_points();
        let fail = |error: point_cloud::Error| Error::registration(&self.name, &error);
        let normals = match (&self.file.normals, self.file.size) {
            (Some(normals), _) => Some(normals.iter().map(|n| Vector3::from(n.map(f64::from))).collect()),
            (None, Some([width, height])) => {
                let options = OrganisedNormalOptions {
                    half_width_px: normal_half_width_px,
                    widest_half_width_px: windows.widest(normal_half_width_px),
                    ..OrganisedNormalOptions::default()
                };
                Some(organised_normals(&points, width, height, &options).map_err(fail)?)
            }
            (None, None) => None,
        };
        // Zero means unknown to many a program that writes a column of sigmas.
        let sigma = self.file.sigma.as_ref().map(|sigma| {
            let known = |value: &f32| if *value > 0.0 && value.is_finite() { *value } else { f32::NAN };
            sigma.iter().map(known).collect::<Vec<_>>()
        });
        let mut cloud = Cloud::from_frame(&points, normals.as_deref(), sigma.as_deref()).map_err(fail)?;
        if let Some(intensity) = &self.file.intensity {
            let finite = points.iter().zip(intensity).filter(|(point, _)| point.iter().all(|x| x.is_finite()));
            let values: Vec<f64> = finite.map(|(_, value)| f64::from(*value)).collect();
            cloud.intensity = (values.len() == cloud.len()).then_some(values);
        }
        if cloud.len() < FEWEST_POINTS {
            let (found, of) = (cloud.len(), points.len());
            return Err(Error::Register(format!(
                "{}: {found} usable points of {of}, at least {FEWEST_POINTS} are needed",
                self.name
            )));
        }
        Ok(cloud)
    }
}
