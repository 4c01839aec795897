//! Surveys and clouds as stations with points, normals and what is known of them.

use std::path::Path;

use camera_model::OrganisedCloud;
use icp_registration::{Cloud, OrganisedNormalOptions, organised_normals};
use nalgebra::{Isometry3, Vector3};
use range_io::clouds::{CloudFile, read_any_cloud};
use range_io::survey::{Level, Survey};

use super::{RegisterMethod, RegisterRequest};
use crate::load::root_of;
use crate::outcome::Outcome;
use crate::plan::{
    AverageOptions, CorrectImagePointOptions, CorrectRangeOptions, DeconvolveOptions, DemodulateOptions, FlagOptions,
    PointCloudOptions, UnwrapOptions,
};
use crate::progress::Progress;
use crate::run::process;
use crate::{Error, Plan, Result, Stage};

/// One cloud to register, in its own frame.
pub(crate) struct Station {
    pub(crate) name: String,
    pub(crate) timestamp_s: f64,
    /// All points with what the input says of them; what is written in the end.
    pub(crate) file: CloudFile,
    /// The frame's pixels, where it is one of a camera.
    pub(crate) organised: Option<OrganisedCloud>,
    /// Where the input says it stands.
    pub(crate) approximate: Option<Isometry3<f64>>,
    /// Where it truly stands, of simulated surveys.
    pub(crate) truth: Option<Isometry3<f64>>,
}

/// Everything that is to be registered; at least two stations.
pub(super) fn read(request: &RegisterRequest, progress: &dyn Progress) -> Result<Vec<Station>> {
    let stations = match request.inputs.as_slice() {
        [] => return Err(Error::Register("no input is named: name one survey folder, or two and more clouds".into())),
        [survey] if is_survey(survey) => survey_stations(survey, request, progress)?,
        clouds => cloud_stations(clouds, request.method, progress)?,
    };
    if stations.len() < 2 {
        let name = request.inputs[0].display();
        return Err(Error::Register(format!("{name} holds one station; at least two are needed")));
    }
    Ok(stations)
}

/// Whether the path is a folder with `survey.ron`, or that file.
fn is_survey(path: &Path) -> bool {
    path.is_dir() || path.file_name().is_some_and(|name| name == Survey::FILE_NAME)
}

fn survey_stations(path: &Path, request: &RegisterRequest, progress: &dyn Progress) -> Result<Vec<Station>> {
    let survey = Survey::read(path)?;
    let calibrated = request.calibration.is_some() || root_of(path).join("calibration.ron").is_file();
    let plan = Plan {
        name: "register".to_owned(),
        source: None,
        calibrate: None,
        stages: stages(survey.level, calibrated, request.method),
    };
    let outcome = process(&plan, path, request.calibration.as_deref(), progress)?;
    Ok(stations_of(outcome))
}

/// The way from the survey's level to flagged points. Frames of a stream stay single.
fn stages(level: Level, calibrated: bool, method: RegisterMethod) -> Vec<Stage> {
    let mut stages = Vec::new();
    if level == Level::Samples {
        stages.push(Stage::Demodulate(DemodulateOptions::default()));
    }
    if method != RegisterMethod::Track {
        stages.push(Stage::Average(AverageOptions::default()));
    }
    if matches!(level, Level::Samples | Level::Phase) {
        if calibrated {
            stages.push(Stage::Deconvolve(DeconvolveOptions::default()));
        }
        stages.push(Stage::Unwrap(UnwrapOptions::default()));
    }
    if calibrated {
        stages.push(Stage::CorrectRange(CorrectRangeOptions::default()));
        stages.push(Stage::CorrectImagePoint(CorrectImagePointOptions::default()));
    }
    stages.push(Stage::PointCloud(PointCloudOptions::default()));
    stages.push(Stage::Flag(FlagOptions::default()));
    stages
}

fn stations_of(outcome: Outcome) -> Vec<Station> {
    let single = {
        let mut names: Vec<&str> = outcome.views.iter().map(|view| view.station.as_str()).collect();
        names.sort_unstable();
        names.windows(2).all(|pair| pair[0] != pair[1])
    };
    let station = |(index, (view, cloud)): (usize, (&crate::View, &OrganisedCloud))| Station {
        name: if single { view.station.clone() } else { format!("{}/{index}", view.station) },
        timestamp_s: view.timestamp_s,
        file: CloudFile {
            points: cloud.points.clone(),
            intensity: Some(cloud.amplitude.clone()),
            sigma: Some(cloud.sigma.clone()),
            flags: Some(cloud.flags.iter().map(|flags| flags.bits()).collect()),
            size: Some([cloud.width, cloud.height]),
            ..CloudFile::default()
        },
        organised: Some(cloud.clone()),
        approximate: view.approximate_world_from_camera,
        truth: view.truth.as_ref().and_then(|truth| truth.world_from_camera),
    };
    outcome.views.iter().zip(&outcome.clouds).enumerate().map(station).collect()
}

fn cloud_stations(
    paths: &[std::path::PathBuf],
    method: RegisterMethod,
    progress: &dyn Progress,
) -> Result<Vec<Station>> {
    if method == RegisterMethod::Track {
        return Err(Error::Register("--track needs a survey of frames, clouds have no pixels".into()));
    }
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
            file,
            organised: None,
            truth: None,
        });
        progress.advance(index + 1);
    }
    Ok(stations)
}

impl Station {
    /// The usable points with normals, sigma and intensity: those that are finite and carry no flag.
    pub(super) fn cloud(&self) -> Result<Cloud> {
        let usable = |index: usize| self.file.flags.as_ref().is_none_or(|flags| flags[index] == 0);
        let points: Vec<[f64; 3]> = self.file.points.iter().enumerate().map(|(index, point)| {
            if usable(index) { *point } else { [f64::NAN; 3] }
        }).collect();
        let fail = |error: icp_registration::Error| Error::Register(format!("{}: {error}", self.name));
        let normals = match (&self.file.normals, self.file.size) {
            (Some(normals), _) => Some(normals.iter().map(|n| Vector3::from(n.map(f64::from))).collect()),
            (None, Some([width, height])) => {
                let options = OrganisedNormalOptions { half_width_px: 3, ..OrganisedNormalOptions::default() };
                Some(organised_normals(&points, width, height, &options).map_err(fail)?)
            }
            (None, None) => None,
        };
        let sigma = self.file.sigma.as_deref();
        let mut cloud = Cloud::from_frame(&points, normals.as_deref(), sigma).map_err(fail)?;
        if let Some(intensity) = &self.file.intensity {
            let finite = points.iter().zip(intensity).filter(|(point, _)| point.iter().all(|x| x.is_finite()));
            cloud.intensity = Some(finite.map(|(_, value)| f64::from(*value)).collect());
        }
        if cloud.is_empty() {
            return Err(Error::Register(format!("{}: no usable point among {}", self.name, points.len())));
        }
        Ok(cloud)
    }
}
