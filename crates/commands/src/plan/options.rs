//! What the stages can be told.

use multipath::MixedPixelTreatment;
use range_image::{ConsistencyOptions, FusionOptions, InterferenceOptions, RestOptions};
use serde::{Deserialize, Serialize};

#[cfg(doc)]
use crate::plan::Stage;

/// Options of [`Stage::Demodulate`]; phase sense, offset, scale and saturation are the survey's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DemodulateOptions {
    /// Amplitude below which the phase of a single frame is too noisy, in the samples' unit; pixels below it are
    /// flagged. A mean of n frames is held to the same noise of the phase, which it has at `1 / √n` of this amplitude.
    /// Default: `None`.
    pub low_amplitude: Option<f64>,
    /// Noise of one sample where no calibration states it. Default: `None`.
    pub noise: Option<NoiseOptions>,
    /// How the samples of a pixel are checked against each other, which tells motion and saturation; `None`: not at
    /// all. Nothing is checked either where neither the noise nor a tolerance is known. Default: that of
    /// [`ConsistencyOptions`].
    pub consistency: Option<ConsistencyOptions>,
    /// When contradictory samples are laid to light of another camera instead of motion. Default: that of
    /// [`InterferenceOptions`].
    pub interference: InterferenceOptions,
}

impl Default for DemodulateOptions {
    fn default() -> Self {
        Self {
            low_amplitude: None,
            noise: None,
            consistency: Some(ConsistencyOptions::default()),
            interference: InterferenceOptions::default(),
        }
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
    /// Default: that of [`RestOptions`].
    pub rest: RestOptions,
    /// Where sigma is known, in complex images: when light of another camera counts as found (what it disturbs is
    /// flagged). Default: that of [`InterferenceOptions`].
    pub interference: InterferenceOptions,
}

/// Options of [`Stage::Deconvolve`].
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DeconvolveOptions {
    /// Tikhonov term of the inverse filter; zero is the plain inverse. Default: 0.
    pub regularisation: f64,
}

/// Options of [`Stage::Unwrap`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct UnwrapOptions {
    /// No range is longer than this, metre; bounds the wrap counts that are tried. `None`, the default: 15 m, or the
    /// interval in which several frequencies together are unique, where that is shorter.
    pub maximum_range_m: Option<f64>,
    /// Below this confidence (0 to 1) a pixel is flagged as unsure. Default: 0.5.
    pub minimum_confidence: f64,
    /// What the counts of a single frequency come from. Several frequencies need none of this: each pixel's own decide.
    /// Default: [`UnwrapMethod::Tree`].
    pub method: UnwrapMethod,
}

impl Default for UnwrapOptions {
    fn default() -> Self {
        Self { maximum_range_m: None, minimum_confidence: 0.5, method: UnwrapMethod::default() }
    }
}

/// What the wrap counts of a single frequency come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum UnwrapMethod {
    /// A spanning tree over each segment of the measured phase: for phase noise below 0.3 rad nearly everywhere.
    #[default]
    Tree,
    /// The same over the phase after a filter that follows its fringes: for little light.
    Filter,
    /// The cheapest cuts of the measured phase: for little light on surfaces that bend within a few pixels.
    Cuts,
    /// The tree where fewer than one pixel in twenty has 0.3 rad of noise; else what makes the smoothest surface.
    Auto,
}

impl From<UnwrapMethod> for phase_unwrap::NoisyMethod {
    fn from(method: UnwrapMethod) -> Self {
        match method {
            UnwrapMethod::Tree => Self::Tree,
            UnwrapMethod::Filter => Self::Filter,
            UnwrapMethod::Cuts => Self::Cuts,
            UnwrapMethod::Auto => Self::Auto,
        }
    }
}

/// Options of [`Stage::RepairWraps`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RepairWrapsOptions {
    /// Ambiguity interval, metre, where the survey states no modulation frequency. Default: `None`.
    pub interval_m: Option<f64>,
    /// No range is longer than this, metre; bounds the intervals that are tried. Default: 15 m.
    pub maximum_range_m: f64,
    /// Below this confidence (0 to 1) a pixel keeps its value and is flagged as unsure. Default: 0.8.
    pub minimum_confidence: f64,
    /// What the camera has done to its amplitudes. Default: [`AmplitudeKind::Unknown`].
    pub amplitudes: AmplitudeKind,
}

/// What a camera's amplitudes stand for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AmplitudeKind {
    /// One of the two below: a count is sure where one of them makes it sure and the other does not contradict.
    #[default]
    Unknown,
    /// The signal received: a surface that is twice as far is four times as dark.
    Received,
    /// The signal times the square of the range that the camera reports, so that near and far surfaces look alike.
    RangeCompensated,
}

impl From<AmplitudeKind> for phase_unwrap::AmplitudeKind {
    fn from(kind: AmplitudeKind) -> Self {
        match kind {
            AmplitudeKind::Unknown => Self::Unknown,
            AmplitudeKind::Received => Self::Received,
            AmplitudeKind::RangeCompensated => Self::RangeCompensated,
        }
    }
}

impl Default for RepairWrapsOptions {
    fn default() -> Self {
        Self { interval_m: None, maximum_range_m: 15.0, minimum_confidence: 0.8, amplitudes: AmplitudeKind::default() }
    }
}

/// Options of [`Stage::Multipath`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MultipathOptions {
    /// Probability that a pixel with one path is flagged where frequencies are compared. Default: 1e-4.
    pub false_alarm_probability: f64,
    /// Standard deviation of what calibration leaves of the range errors of one frequency, metre. Default: 0.005 m.
    pub floor_m: f64,
    /// Pixels are flagged whose ranges are wrong by more than this, metre, and by more than their standard deviation,
    /// with odds of nineteen to one, by light that the scene bounces: where the walls of the view are bent as that
    /// light would bend them. `None`: the expected error is pictured in the report and flags nothing. Default: 0.02 m.
    pub flag_risk_above_m: Option<f64>,
    /// Probability that a view counts as bent that is not. Default: 0.01.
    pub bending_false_alarm_probability: f64,
    /// What is done where frequencies contradict each other. Default: [`MultipathTreatment::Flag`].
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
            bending_false_alarm_probability: 0.01,
            treatment: MultipathTreatment::default(),
        }
    }
}

/// Options of [`Stage::CorrectImagePoint`].
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CorrectImagePointOptions {}

/// Options of [`Stage::FuseExposures`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FuseExposuresOptions {
    /// Probability that exposures of a scene at rest count as contradictory in a pixel. Default: 1e-4.
    pub false_alarm_probability: f64,
    /// Standard deviation of what calibration leaves in one exposure and not in the others, metre. Default: 0.005 m.
    pub floor_m: f64,
}

impl Default for FuseExposuresOptions {
    fn default() -> Self {
        let FusionOptions { false_alarm_probability, floor_m, .. } = FusionOptions::default();
        Self { false_alarm_probability, floor_m }
    }
}

/// Options of [`Stage::PointCloud`].
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PointCloudOptions {
    /// Standard deviation of an image point along column and row, pixels. Default: `None`.
    pub sigma_pixel: Option<[f64; 2]>,
}

/// Options of [`Stage::Flag`].
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FlagOptions {
    /// Amplitude below which a pixel is flagged, in the camera's unit, whatever the number of frames: for what noise is
    /// not the reason of. For noise, use `maximum_sigma_m`. Default: `None`.
    pub low_amplitude: Option<f64>,
    /// Standard deviation of the range above which a pixel is flagged as of low amplitude, metre. Default: `None`.
    pub maximum_sigma_m: Option<f64>,
    /// How spikes at edges are told from surfaces. Default: that of [`MixedPixels`].
    pub mixed_pixels: MixedPixels,
}

/// How far a pixel must lie off the surfaces at both sides to count as mixed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MixedPixels {
    /// Distance in standard deviations, of the noise of all pixels that take part and of the floor.
    pub sigmas: f64,
    /// Standard deviation of what is no noise: the shape of surfaces, and what calibration leaves; metre.
    pub floor_m: f64,
    /// What is done with them: `flag`, `drop` (no value any more), or `split` (a point on each of the two surfaces besides).
    pub treatment: MixedPixelTreatment,
}

impl Default for MixedPixels {
    fn default() -> Self {
        Self { sigmas: 4.0, floor_m: 0.005, treatment: MixedPixelTreatment::Flag }
    }
}

/// Default of the windows that normals come from.
pub const NORMAL_HALF_WIDTH_PX: usize = 3;

/// Options of [`Stage::Register`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RegisterOptions {
    /// What is known of the poses. Default: what the survey says of them, else the order of the stations.
    pub start: StartPoses,
    /// How far approximate poses may be off, metre, their rotations at the distance of what is seen. Default: 0.5 m.
    pub maximum_distance_m: f64,
    /// Smallest part of a view that must overlap another for the two to be aligned as a pair. Default: 0.3.
    pub minimum_overlap: f64,
    /// Normals come from windows of twice this and one pixel a side; small images want small windows. Default: 3
    /// pixels.
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
    /// How far the poses that `Register` found may be off, metre; of those that it found from the survey's, with the
    /// same overlap, nothing is sought again. Default: 0.1 m.
    pub maximum_distance_m: f64,
    /// Smallest part of a view that must overlap another for the two to be aligned as a pair; the adjustment itself
    /// takes whatever overlaps. Default: 0.3.
    pub minimum_overlap: f64,
}

impl Default for AdjustOptions {
    fn default() -> Self {
        Self { maximum_distance_m: 0.1, minimum_overlap: 0.3 }
    }
}

/// Options of [`Stage::CorrectRange`].
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CorrectRangeOptions {
    /// What is done about the drift of a warming camera. Default: [`DriftTreatment::Apply`].
    pub warm_up: DriftTreatment,
}

/// What is done about the drift of a warming camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DriftTreatment {
    /// It is taken off: as the optical reference shows it, where the survey has one, and else as the calibration says.
    #[default]
    Apply,
    /// It stays in the ranges.
    Leave,
}
