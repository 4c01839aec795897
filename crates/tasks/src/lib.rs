#![doc = include_str!("../README.md")]

mod compare;
mod explain;
mod fixed_pattern;
mod further_term;
mod inertial_unit;
mod inspect;
mod noise;
mod register;
mod scattering;
mod track;
mod warm_up;

pub use self::compare::{
    AbsoluteSummary, CloudAlignment, CloudComparison, CompareAlignment, CompareRequest, Comparison, DistanceHistogram,
    PlaneDistances, PoseComparison, PoseDifference, RelativeSummary, TrajectoryComparison, TrajectoryStatistics,
    compare,
};
pub use self::warm_up::{
    ReferenceUse, WarmUpBlock, WarmUpParameter, WarmUpPhase, WarmUpRateTest, WarmUpRequest, WarmUpSummary, WarmUpTest,
    estimate_warm_up,
};
pub use ::warm_up::{ChangeOptions, DriftOptions, TemperatureUse};
pub use explain::{ExplainRequest, Explanation, FlagReason, StageLine, StagePart, explain};
pub use fixed_pattern::{FixedPatternRequest, FixedPatternSummary, PatternWall, estimate_pattern};
pub use inspect::{Inspection, inspect};
pub use noise::{
    NoiseBin, NoiseParameter, NoiseRequest, NoiseStation, NoiseSummary, SharedSummary, SigmaBinSummary, estimate_noise,
};
pub use pipeline;
pub use register::{
    RegisterMethod, RegisterRequest, RegisterSummary, RegisteredLoop, RegisteredPair, RegisteredPlacement,
    RegisteredStation, register,
};
pub use scattering::{
    CandidateGaussians, ScatteringCapture, ScatteringParameter, ScatteringRequest, ScatteringSummary,
    estimate_scattering,
};
pub use scattering_deconvolution::{EstimationOptions, TermCount, TermShape};
pub use sensor_noise::{NoiseFitOptions, PatternOptions};
pub use track::{TrackLoss, TrackRequest, TrackSummary, TrackTruth, TrackVerdict, TrackedFrame, track};
