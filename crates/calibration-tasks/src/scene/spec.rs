//! What a network's scene says.

use std::collections::BTreeMap;
use std::path::Path;

use camera_model::{Camera, pose_from_euler};
use error_models::{ModelSet, RangeErrorModel};
use nalgebra::{Isometry3, Point3, Vector3};
use pipeline::{Error, Result};
use range_io::calibration::Calibration;
use range_io::ron_text;
use range_io::survey::{Level, Survey, SurveyCamera};
use range_io::tables::Distance;
use self_calibration::{
    DistanceEnd, KnownDistance, Network, NetworkTarget, PassiveCamera, SightingOptions, SimulatedStart, Station,
};
use serde::{Deserialize, Serialize};

/// A network to simulate, read from a RON file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NetworkScene {
    /// Seed of all random numbers, unless the caller names another.
    pub seed: u64,
    /// The nominal camera, as it will stand in `survey.ron`.
    pub camera: SurveyCamera,
    /// True parameters by name (`xp` ... `p2`, `d0` ... `h3`); others are as in the nominal camera, or zero.
    pub truth: BTreeMap<String, f64>,
    /// Smallest and largest amplitude that the true `h1`, `h2`, `h3` hold for.
    #[serde(default)]
    pub amplitude_span: Option<[f64; 2]>,
    /// Targets on a wall.
    #[serde(default)]
    pub field: Option<FieldSpec>,
    /// Further targets.
    #[serde(default)]
    pub targets: Vec<SceneTarget>,
    /// Stations.
    pub stations: Vec<SceneStation>,
    /// Known distances between stations and targets; the distances themselves are measured in the simulation.
    #[serde(default)]
    pub distances: Vec<(String, String, f64)>,
    /// The passive camera of a joint setup.
    #[serde(default)]
    pub passive: Option<PassiveSpec>,
    /// How everything is observed.
    #[serde(default)]
    pub sightings: SightingSpec,
}

/// Targets in rows and columns on the plane z = 0, the middle at the origin, seen from z > 0.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FieldSpec {
    /// Targets along x.
    pub columns: usize,
    /// Targets along y.
    pub rows: usize,
    /// Distance of neighbours, metre.
    pub spacing_m: f64,
    /// How far every third target stands off the wall, metre.
    #[serde(default)]
    pub relief_m: f64,
}

/// A target by its coordinates.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneTarget {
    /// Name.
    pub name: String,
    /// Position, metre.
    pub position_m: [f64; 3],
    /// Standard deviations where it is weighted control, metre.
    #[serde(default)]
    pub sigma_m: Option<[f64; 3]>,
}

/// A station that looks at a point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneStation {
    /// Name.
    pub name: String,
    /// Distance from the point looked at, metre.
    pub distance_m: f64,
    /// The point looked at; the middle of the field where it is left out.
    #[serde(default)]
    pub at_m: [f64; 3],
    /// Angle off the z axis to the right, degree.
    #[serde(default)]
    pub aside_deg: f64,
    /// Angle off the z axis upwards, degree.
    #[serde(default)]
    pub above_deg: f64,
    /// Turn about the viewing axis, degree.
    #[serde(default)]
    pub roll_deg: f64,
    /// Integration time, second.
    #[serde(default)]
    pub integration_time_s: Option<f64>,
}

/// The passive camera of a joint setup.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PassiveSpec {
    /// The nominal camera.
    pub camera: SurveyCamera,
    /// Its true parameters by name, which its calibration states.
    #[serde(default)]
    pub truth: BTreeMap<String, f64>,
    /// Its perspective centre in the range camera's frame, metre.
    pub position_m: [f64; 3],
    /// Its attitude against the range camera (omega, phi, kappa), degree.
    #[serde(default)]
    pub attitude_deg: [f64; 3],
}

/// How a network is observed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SightingSpec {
    /// Standard deviation of a column or row, pixel.
    pub sigma_pixel: f64,
    /// Standard deviation of a range, metre.
    pub sigma_range_m: f64,
    /// Standard deviation of a column or row of the passive camera, pixel.
    pub sigma_passive_pixel: f64,
    /// Share of gross errors, 0 to 1.
    pub gross_error_share: f64,
    /// Amplitude of a target at 1 m; `None`: no amplitudes.
    pub amplitude_at_1_m: Option<f64>,
    /// Darkest and brightest target relative to it.
    pub reflectance_span: [f64; 2],
    /// Standard deviation of the start values of positions, metre.
    pub start_position_m: f64,
    /// Standard deviation of the start values of attitudes, degree.
    pub start_attitude_deg: f64,
}

impl Default for SightingSpec {
    fn default() -> Self {
        Self {
            sigma_pixel: 0.05,
            sigma_range_m: 0.01,
            sigma_passive_pixel: 0.2,
            gross_error_share: 0.0,
            amplitude_at_1_m: None,
            reflectance_span: [1.0; 2],
            start_position_m: 0.05,
            start_attitude_deg: 2.0,
        }
    }
}

impl SightingSpec {
    pub(crate) fn options(&self, seed: u64) -> SightingOptions {
        SightingOptions {
            sigma_pixel: self.sigma_pixel,
            sigma_range_m: self.sigma_range_m,
            sigma_passive_pixel: self.sigma_passive_pixel,
            seed,
            gross_error_share: self.gross_error_share,
            start: SimulatedStart::Disturbed {
                position_m: self.start_position_m,
                attitude_rad: self.start_attitude_deg.to_radians(),
            },
            amplitude_at_1_m: self.amplitude_at_1_m,
            reflectance_span: self.reflectance_span,
        }
    }
}

impl NetworkScene {
    /// Reads and checks a scene; `path` names it in errors.
    pub fn from_ron(text: &str, path: &Path) -> Result<Self> {
        let scene: Self = ron_text::parse(path, text)?;
        scene.check().map_err(|(field, reason)| ron_text::wrong_field(path, text, field, reason))?;
        Ok(scene)
    }

    /// Reads a scene's file.
    pub fn read(path: &Path) -> Result<Self> {
        Self::from_ron(&range_io::read_ron_text(path)?, path)
    }

    /// The true network; `path` names the scene in errors.
    pub(crate) fn network(&self, path: &Path) -> Result<Network> {
        let calibration = true_calibration(&self.camera, &self.truth, self.amplitude_span, path)?;
        let mut network = Network {
            camera: calibration.camera()?,
            range_model: first_model(&calibration)?,
            stations: self.stations.iter().map(SceneStation::station).collect(),
            targets: self.all_targets(),
            sightings: Vec::new(),
            distances: Vec::new(),
            passive: self.passive.as_ref().map(|passive| passive.camera(path)).transpose()?,
        };
        network.distances = self.known_distances(&network, path)?;
        Ok(network)
    }

    fn all_targets(&self) -> Vec<NetworkTarget> {
        let named = self.targets.iter().map(|target| NetworkTarget {
            name: target.name.clone(),
            point: Some(Point3::from(target.position_m)),
            covariance: target
                .sigma_m
                .map(|sigma| nalgebra::Matrix3::from_diagonal(&Vector3::from(sigma.map(|s| s * s)))),
        });
        self.field.iter().flat_map(FieldSpec::targets).chain(named).collect()
    }

    fn known_distances(&self, network: &Network, path: &Path) -> Result<Vec<KnownDistance>> {
        let end = |name: &String| {
            let station = network.stations.iter().position(|station| station.name == *name).map(DistanceEnd::Station);
            let target = || network.targets.iter().position(|target| target.name == *name).map(DistanceEnd::Target);
            station.or_else(target).ok_or_else(|| Error::Survey {
                path: path.to_owned(),
                message: format!("`distances` names `{name}`, which is neither a station nor a target"),
            })
        };
        let place = |end: DistanceEnd| match end {
            DistanceEnd::Station(index) => {
                network.stations[index].world_from_camera.map(|pose| pose.translation.vector)
            }
            DistanceEnd::Target(index) => network.targets[index].point.map(|point| point.coords),
        };
        let distance = |(from, to, sigma_m): &(String, String, f64)| {
            let (from, to) = (end(from)?, end(to)?);
            let apart = place(from).zip(place(to)).map_or(0.0, |(from, to)| (from - to).norm());
            Ok(KnownDistance { from, to, distance_m: apart, sigma_m: *sigma_m })
        };
        self.distances.iter().map(distance).collect()
    }
}

/// Rows of `distances.csv`.
pub(crate) fn distance_rows(network: &Network) -> Vec<Distance> {
    let name = |end: DistanceEnd| match end {
        DistanceEnd::Station(index) => network.stations[index].name.clone(),
        DistanceEnd::Target(index) => network.targets[index].name.clone(),
    };
    let row = |known: &KnownDistance| Distance {
        from: name(known.from),
        to: name(known.to),
        distance_m: known.distance_m,
        sigma_m: known.sigma_m,
    };
    network.distances.iter().map(row).collect()
}

impl FieldSpec {
    /// Name of a target by its number from 1.
    pub(crate) fn name(number: usize) -> String {
        format!("T{number:03}")
    }

    fn targets(&self) -> Vec<NetworkTarget> {
        let middle = |count: usize| 0.5 * (count as f64 - 1.0);
        let mut targets = Vec::new();
        for row in 0..self.rows {
            for column in 0..self.columns {
                let x = (column as f64 - middle(self.columns)) * self.spacing_m;
                let y = (row as f64 - middle(self.rows)) * self.spacing_m;
                let z = if (row + column) % 3 == 0 { self.relief_m } else { 0.0 };
                let name = Self::name(targets.len() + 1);
                targets.push(NetworkTarget { name, point: Some(Point3::new(x, y, z)), covariance: None });
            }
        }
        targets
    }
}

impl SceneStation {
    fn station(&self) -> Station {
        let angles = [self.above_deg, self.aside_deg, self.roll_deg].map(f64::to_radians);
        let turned = pose_from_euler(Vector3::zeros(), angles);
        let position = Vector3::from(self.at_m) + turned * Vector3::new(0.0, 0.0, self.distance_m);
        Station {
            name: self.name.clone(),
            world_from_camera: Some(Isometry3::from_parts(position.into(), turned.rotation)),
            covariance: None,
            integration_time_s: self.integration_time_s,
            drift_m: 0.0,
        }
    }
}

impl PassiveSpec {
    fn camera(&self, path: &Path) -> Result<PassiveCamera> {
        let calibration = self.calibration(path)?;
        let attitude = self.attitude_deg.map(f64::to_radians);
        Ok(PassiveCamera {
            camera: calibration.camera()?,
            covariance: None,
            range_camera_from_passive: Some(pose_from_euler(Vector3::from(self.position_m), attitude)),
            image_points: Vec::new(),
        })
    }

    /// The calibration that the passive camera comes with.
    pub(crate) fn calibration(&self, path: &Path) -> Result<Calibration> {
        let camera = true_camera(&self.camera, &self.truth, path)?;
        Ok(Calibration::from_models(&camera, &ModelSet::default(), None)?)
    }
}

/// The true calibration of a range camera.
pub(crate) fn true_calibration(
    nominal: &SurveyCamera,
    truth: &BTreeMap<String, f64>,
    amplitude_span: Option<[f64; 2]>,
    path: &Path,
) -> Result<Calibration> {
    let camera = true_camera(nominal, &only_camera(truth), path)?;
    let modulations = nominal.modulations()?;
    let [modulation] = modulations.as_slice() else {
        let message = format!("`camera.modulation_hz` has {} frequencies, expected one", modulations.len());
        return Err(Error::Survey { path: path.to_owned(), message });
    };
    let error_free = RangeErrorModel::error_free(modulation.ambiguity_interval_m());
    let mut calibration =
        Calibration::from_models(&camera, &ModelSet { entries: vec![(1.0, vec![error_free])] }, None)?;
    for (name, value) in truth.iter().filter(|(name, _)| !is_camera_parameter(name)) {
        let model = &mut calibration.range_models[0];
        model.amplitude_span = amplitude_span;
        match model.parameters.iter_mut().find(|parameter| parameter.name == *name) {
            Some(parameter) => parameter.value = *value,
            None => model.parameters.push(
                error_models::NamedParameter::held(name, *value)
                    .map_err(|error| Error::Survey { path: path.to_owned(), message: format!("`truth`: {error}") })?,
            ),
        }
    }
    calibration.validate()?;
    Ok(calibration)
}

fn is_camera_parameter(name: &str) -> bool {
    Calibration::CAMERA_PARAMETERS.iter().any(|(known, _)| *known == name)
}

fn only_camera(truth: &BTreeMap<String, f64>) -> BTreeMap<String, f64> {
    truth.iter().filter(|(name, _)| is_camera_parameter(name)).map(|(name, value)| (name.clone(), *value)).collect()
}

/// The nominal camera with true parameters.
fn true_camera(nominal: &SurveyCamera, truth: &BTreeMap<String, f64>, path: &Path) -> Result<Camera> {
    let mut calibration = Calibration::from_models(&nominal.nominal_camera()?, &ModelSet::default(), None)?;
    for (name, value) in truth {
        let parameter = calibration.parameters.iter_mut().find(|parameter| parameter.name == *name);
        let Some(parameter) = parameter else {
            let message = format!("`truth` names `{name}`, which is no parameter of a camera");
            return Err(Error::Survey { path: path.to_owned(), message });
        };
        parameter.value = *value;
    }
    calibration.validate()?;
    Ok(calibration.camera()?)
}

fn first_model(calibration: &Calibration) -> Result<RangeErrorModel> {
    let models = calibration.model_set()?;
    let mut all = models.entries.into_iter().flat_map(|(_, models)| models);
    all.next().ok_or_else(|| Error::Camera("the scene has no range model".to_owned()))
}

/// A survey of tables alone.
pub(crate) fn survey_of_tables(camera: &SurveyCamera) -> Survey {
    Survey::new(camera.clone(), Level::Range, Vec::new())
}
