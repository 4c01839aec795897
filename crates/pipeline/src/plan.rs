//! A pipeline as data: named stages with options, in the order of the conventions.

use std::path::Path;

use multipath::MixedPixelTreatment;
use range_image::{ConsistencyOptions, RestOptions};
use range_io::ron_text;
use range_io::survey::Level;
use serde::{Deserialize, Serialize};

pub use crate::drift::CorrectRangeOptions;
use crate::{Error, Result};

/// What a pipeline does, read from a RON file.
///
/// ```
/// let plan = pipeline::Plan::from_ron(r#"(
///     name: "walls",
///     stages: [Demodulate(low_amplitude: 40), Average(), Unwrap(), PointCloud()],
/// )"#, "walls.ron".as_ref()).expect("a valid plan");
/// assert_eq!(plan.stages.len(), 4);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// Name of the pipeline; the default output folder is called after it.
    pub name: String,
    /// Where the frames come from, unless the caller names a survey.
    #[serde(default)]
    pub source: Option<Source>,
    /// A calibration to be estimated first, from a simulated network of targets, and used instead of the survey's.
    #[serde(default)]
    pub calibrate: Option<NetworkCalibration>,
    /// The stages, in order.
    pub stages: Vec<Stage>,
}

/// A network of targets to simulate, and what to estimate from it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NetworkCalibration {
    /// The network's RON file, relative to the pipeline's.
    pub network: String,
    /// Names of the terms to estimate; all others are held at their nominal values.
    pub terms: Vec<String>,
}

/// Where a pipeline's frames come from; paths are relative to the pipeline's file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Source {
    /// A scene is simulated first.
    Simulate(SimulateSource),
    /// A survey folder that is there already.
    Survey {
        /// The folder with `survey.ron`.
        folder: String,
    },
}

/// A scene to simulate and how its stations are announced.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SimulateSource {
    /// The scene's RON file.
    pub scene: String,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Standard deviation of the approximate station positions handed to the pipeline, metre.
    #[serde(default = "SimulateSource::position_sigma")]
    pub approximate_position_sigma_m: f64,
    /// Standard deviation of the approximate attitudes about each axis, degree.
    #[serde(default = "SimulateSource::attitude_sigma")]
    pub approximate_attitude_sigma_deg: f64,
    /// Part of the pixels of each station that show anything, beside what the scene says. Default 0.
    #[serde(default)]
    pub gross_error_share: f64,
}

impl SimulateSource {
    fn position_sigma() -> f64 {
        0.05
    }

    fn attitude_sigma() -> f64 {
        2.0
    }
}

macro_rules! stages {
    ($($(#[$doc:meta])* $name:ident($options:ty) from $level:ident,)*) => {
        /// One stage with its options; the variants stand in the order in which stages run.
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        pub enum Stage {
            $($(#[$doc])* $name(#[serde(default)] $options),)*
        }

        impl Stage {
            /// Names of all stages in the order in which they run.
            pub const NAMES: &[&'static str] = &[$(stringify!($name)),*];

            /// All stages with the last level that they can still work on.
            pub const ALL_NEEDS: &[(&'static str, Level)] = &[$((stringify!($name), Level::$level)),*];

            /// The stage's name as it stands in the pipeline's file.
            pub fn name(&self) -> &'static str {
                match self { $(Self::$name(_) => stringify!($name),)* }
            }

            /// The last level, from samples to depth, that the stage can still work on.
            pub fn needs(&self) -> Level {
                match self { $(Self::$name(_) => Level::$level,)* }
            }
        }
    };
}

stages! {
    /// Raw samples to complex images.
    Demodulate(DemodulateOptions) from Samples,
    /// Frames of one station to one frame: mean of the complex images, or of the ranges.
    Average(AverageOptions) from Range,
    /// Internal scattering is taken off the complex images.
    Deconvolve(DeconvolveOptions) from Phase,
    /// Phases to ranges with their whole ambiguity intervals.
    Unwrap(UnwrapOptions) from Phase,
    /// Intervals that ranges or depths have lost are added, where the camera gives no phases.
    RepairWraps(RepairWrapsOptions) from Range,
    /// Systematic range errors are taken off.
    CorrectRange(CorrectRangeOptions) from Range,
    /// Image points are corrected for lens distortion and the calibrated interior orientation.
    CorrectImagePoint(CorrectImagePointOptions) from Range,
    /// Light that came by more than one way is flagged, and taken off where three frequencies or more allow it.
    Multipath(MultipathOptions) from Range,
    /// Ranges to points in the camera's frame.
    PointCloud(PointCloudOptions) from Range,
    /// Gross errors are flagged.
    Flag(FlagOptions) from Range,
    /// Overlapping stations are aligned pair by pair.
    Register(RegisterOptions) from Range,
    /// All stations are adjusted at once.
    Adjust(AdjustOptions) from Range,
}

/// Options of [`Stage::Demodulate`]; phase sense, offset, scale and saturation are the survey's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DemodulateOptions {
    /// Amplitude below which a pixel is flagged, in the samples' unit.
    pub low_amplitude: Option<f64>,
    /// Noise of one sample where no calibration states it.
    pub noise: Option<NoiseOptions>,
    /// How the samples of a pixel are checked against each other, which tells motion and saturation; `None`: not at all.
    /// Nothing is checked either where neither the noise nor a tolerance is known.
    pub consistency: Option<ConsistencyOptions>,
}

impl Default for DemodulateOptions {
    fn default() -> Self {
        Self { low_amplitude: None, noise: None, consistency: Some(ConsistencyOptions::default()) }
    }
}

/// Noise of one raw sample: variance = `shot_variance_per_unit * sample + dark_sigma^2`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NoiseOptions {
    /// Shot noise, variance per unit of the sample.
    pub shot_variance_per_unit: f64,
    /// Dark and readout noise, standard deviation in the samples' unit.
    pub dark_sigma: f64,
}

/// Options of [`Stage::Average`].
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AverageOptions {
    /// Where sigma is known: which pixels count as moved (they are flagged), and which stations as moved or drifting.
    pub rest: RestOptions,
}

/// Options of [`Stage::Deconvolve`].
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DeconvolveOptions {
    /// Tikhonov term of the inverse filter; zero is the plain inverse.
    pub regularisation: f64,
}

/// Options of [`Stage::Unwrap`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct UnwrapOptions {
    /// No range is longer than this, metre; bounds the wrap counts that are tried. `None`: 15 m, or the interval in which
    /// several frequencies together are unique, where that is shorter.
    pub maximum_range_m: Option<f64>,
    /// Below this confidence (0 to 1) a pixel is flagged as unsure.
    pub minimum_confidence: f64,
}

impl Default for UnwrapOptions {
    fn default() -> Self {
        Self { maximum_range_m: None, minimum_confidence: 0.5 }
    }
}

/// Options of [`Stage::RepairWraps`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RepairWrapsOptions {
    /// Ambiguity interval, metre, where the survey states no modulation frequency.
    pub interval_m: Option<f64>,
    /// No range is longer than this, metre; bounds the intervals that are tried.
    pub maximum_range_m: f64,
    /// Below this confidence (0 to 1) a pixel keeps its value and is flagged as unsure.
    pub minimum_confidence: f64,
}

impl Default for RepairWrapsOptions {
    fn default() -> Self {
        Self { interval_m: None, maximum_range_m: 15.0, minimum_confidence: 0.8 }
    }
}

/// Options of [`Stage::Multipath`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MultipathOptions {
    /// Probability that a pixel with one path is flagged where frequencies are compared.
    pub false_alarm_probability: f64,
    /// Standard deviation of what calibration leaves of the range errors of one frequency, metre.
    pub floor_m: f64,
    /// Pixels are flagged where the light that the scene bounces once is expected to move them by more than this, metre;
    /// `None`: the expected error is pictured in the report and flags nothing.
    pub flag_risk_above_m: Option<f64>,
    /// What is done where frequencies contradict each other.
    pub treatment: MultipathTreatment,
}

/// What is done with pixels whose frequencies contradict each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MultipathTreatment {
    /// They are flagged.
    #[default]
    Flag,
    /// They get the range of the direct path where at least three frequencies determine it, and are flagged elsewhere.
    Resolve,
}

impl Default for MultipathOptions {
    fn default() -> Self {
        Self {
            false_alarm_probability: 1e-4,
            floor_m: 0.005,
            flag_risk_above_m: Some(0.02),
            treatment: MultipathTreatment::default(),
        }
    }
}

/// Options of [`Stage::CorrectImagePoint`].
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CorrectImagePointOptions {}

/// Options of [`Stage::PointCloud`].
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PointCloudOptions {
    /// Standard deviation of an image point along column and row, pixels.
    pub sigma_pixel: Option<[f64; 2]>,
}

/// Options of [`Stage::Flag`].
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FlagOptions {
    /// Amplitude below which a pixel is flagged, in the camera's unit.
    pub low_amplitude: Option<f64>,
    /// Standard deviation of the range above which a pixel is flagged as of low amplitude, metre.
    pub maximum_sigma_m: Option<f64>,
    /// How spikes at edges are told from surfaces.
    pub mixed_pixels: MixedPixels,
}

/// How far a pixel must lie off the surfaces at both sides to count as mixed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MixedPixels {
    /// Distance in standard deviations.
    pub sigmas: f64,
    /// Smallest distance, metre.
    pub floor_m: f64,
    /// What is done with them: `flag`, `drop` (no value any more), or `split` (a point on each of the two surfaces besides).
    pub treatment: MixedPixelTreatment,
}

impl Default for MixedPixels {
    fn default() -> Self {
        Self { sigmas: 4.0, floor_m: 0.02, treatment: MixedPixelTreatment::Flag }
    }
}

/// Default of the windows that normals come from.
pub(crate) const NORMAL_HALF_WIDTH_PX: usize = 3;

/// Options of [`Stage::Register`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RegisterOptions {
    /// What is known of the poses. Default: what the survey says of them, else the order of the stations.
    pub start: StartPoses,
    /// How far approximate poses may be off, metre, their rotations at the distance of what is seen.
    pub maximum_distance_m: f64,
    /// Smallest part of a view that must overlap another for the two to be aligned as a pair.
    pub minimum_overlap: f64,
    /// Normals come from windows of twice this and one pixel a side; small images want small windows.
    pub normal_half_width_px: usize,
}

/// Where the registration starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StartPoses {
    /// From the approximate poses of the survey; without any, as [`Self::Order`].
    #[default]
    Approximate,
    /// Without poses: stations that follow each other overlap.
    Order,
    /// Each station stands near the one before and looks the same way: a camera that is moved a little. Each is aligned
    /// onto the one before.
    Neighbour,
}

impl Default for RegisterOptions {
    fn default() -> Self {
        let (start, normal_half_width_px) = (StartPoses::default(), NORMAL_HALF_WIDTH_PX);
        Self { start, maximum_distance_m: 0.5, minimum_overlap: 0.3, normal_half_width_px }
    }
}

/// Options of [`Stage::Adjust`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AdjustOptions {
    /// How far the poses that `Register` found may be off, metre.
    pub maximum_distance_m: f64,
    /// Smallest part of a view that must overlap another for the two to be aligned as a pair; the adjustment itself
    /// takes whatever overlaps.
    pub minimum_overlap: f64,
}

impl Default for AdjustOptions {
    fn default() -> Self {
        Self { maximum_distance_m: 0.1, minimum_overlap: 0.3 }
    }
}

/// Whether frames of a level are past what a stage needs. A depth becomes a range as it is read.
pub(crate) fn is_past(level: Level, needs: Level) -> bool {
    level.min(Level::Range) > needs
}

impl Plan {
    /// Reads a plan; `path` names it in errors.
    pub fn from_ron(text: &str, path: &Path) -> Result<Self> {
        // Stages are written `Flag(low_amplitude: 100)`, without a second pair of parentheses. On the text's own first
        // line, so that the lines of errors stay right.
        let plan: Self = ron_text::parse(path, &format!("#![enable(unwrap_variant_newtypes)]{text}"))?;
        plan.check_order()?;
        Ok(plan)
    }

    /// Reads a plan's file.
    pub fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|source| Error::Access { path: path.to_owned(), source })?;
        Self::from_ron(&text, path)
    }

    /// Refuses stages that the survey's level does not leave room for, by name.
    pub fn check_level(&self, level: Level) -> Result<()> {
        let past = self.stages.iter().find(|stage| is_past(level, stage.needs()));
        past.map_or(Ok(()), |stage| {
            Err(Error::RuledOut { stage: stage.name(), needs: stage.needs().name(), level: level.name() })
        })
    }

    fn check_order(&self) -> Result<()> {
        let position = |stage: &Stage| Stage::NAMES.iter().position(|name| *name == stage.name());
        match self.stages.windows(2).find(|pair| position(&pair[1]) <= position(&pair[0])) {
            None => Ok(()),
            Some(pair) => {
                Err(Error::Order { stage: pair[1].name(), after: pair[0].name(), order: Stage::NAMES.join(", ") })
            }
        }
    }
}
