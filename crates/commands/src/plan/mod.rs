//! A pipeline as data: named stages with options, in the order of the conventions.

use std::collections::BTreeMap;
use std::path::Path;

use range_io::ron_text;
use range_io::survey::Level;
use serde::{Deserialize, Serialize};

use crate::{Error, Result};

pub(crate) mod check;
pub(crate) mod options;

pub use check::{Fault, Rule, check_numbers};
pub use options::{
    AdjustOptions, AmplitudeKind, AverageOptions, CorrectImagePointOptions, CorrectRangeOptions, DeconvolveOptions,
    DemodulateOptions, DriftTreatment, FlagOptions, FuseExposuresOptions, MixedPixels, MultipathOptions,
    MultipathTreatment, NORMAL_HALF_WIDTH_PX, NoiseOptions, PointCloudOptions, RegisterOptions, RepairWrapsOptions,
    StartPoses, UnwrapMethod, UnwrapOptions,
};

/// What a pipeline does, read from a RON file.
///
/// ```
/// let plan = commands::plan::Plan::from_ron(r#"(
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
    /// Frames of one station and integration time to one frame: mean of the complex images, or of the ranges.
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
    /// Frames of one station with different integration times to one frame.
    FuseExposures(FuseExposuresOptions) from Range,
    /// Ranges, less what the width of their pixels does to them, to points in the camera's frame.
    PointCloud(PointCloudOptions) from Range,
    /// Gross errors are flagged.
    Flag(FlagOptions) from Range,
    /// Overlapping stations are aligned pair by pair.
    Register(RegisterOptions) from Range,
    /// All stations are adjusted at once.
    Adjust(AdjustOptions) from Range,
}

/// Whether frames of a level are past what a stage needs. A depth becomes a range as it is read; light alone never does.
pub fn is_past(level: Level, needs: Level) -> bool {
    match level {
        Level::Intensity => true,
        level => level.min(Level::Range) > needs,
    }
}

impl Plan {
    /// Reads a plan; `path` names it in errors.
    pub fn from_ron(text: &str, path: &Path) -> Result<Self> {
        // Stages are written `Flag(low_amplitude: 100)`, without a second pair of parentheses. On the text's own first
        // line, so that the lines of errors stay right.
        let text = format!("#![enable(unwrap_variant_newtypes)]{text}");
        let plan: Self = ron_text::parse(path, &text)?;
        plan.check().map_err(|(field, reason)| ron_text::wrong_field(path, &text, field, reason))?;
        crate::destination::check_name(path, &plan.name)?;
        plan.check_order()?;
        Ok(plan)
    }

    /// Reads a plan's file.
    pub fn read(path: &Path) -> Result<Self> {
        let text = range_io::read_ron_text(path)?;
        let plan = Self::from_ron(&text, path)?;
        plan.check_stages().map_err(|(field, reason)| ron_text::wrong_field(path, &text, field, reason))?;
        Ok(plan)
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

/// The stages that bring frames of a level to one unwrapped, uncorrected range image a station; scattering is taken off
/// where the calibration knows it.
pub fn to_ranges(level: Level, restores: bool) -> Vec<Stage> {
    let mut stages = Vec::new();
    if level == Level::Samples {
        stages.push(Stage::Demodulate(DemodulateOptions::default()));
    }
    stages.push(Stage::Average(AverageOptions::default()));
    if level <= Level::Phase {
        if restores {
            stages.push(Stage::Deconvolve(DeconvolveOptions::default()));
        }
        stages.push(Stage::Unwrap(UnwrapOptions::default()));
    }
    stages
}

/// Stages that frames of this level leave no room for.
pub fn ruled_out(level: Level) -> BTreeMap<String, String> {
    let blocked = Stage::ALL_NEEDS.iter().filter(|(_, needs)| is_past(level, *needs));
    let reason = |needs: &Level| format!("needs level `{}`; the frames are at level `{}`", needs.name(), level.name());
    blocked.map(|(name, needs)| ((*name).to_owned(), reason(needs))).collect()
}
