#![doc = include_str!("../README.md")]

mod calibrate;
mod compare;
mod compatible;
mod correction_record;
mod destination;
mod diff;
mod drift;
mod error;
mod explain;
mod fixed_pattern;
mod frame_rates;
mod further_term;
mod inspect;
mod load;
mod measure;
mod network_plan;
mod network_scene;
mod noise;
mod outcome;
mod pages;
mod plan;
mod plausibility;
mod point_uncertainty;
mod progress;
mod register;
mod results;
mod run;
mod scattering;
mod simulate;
mod span;
mod stages;
mod statistics;
mod summary;
mod track;
mod trends;
mod truth;
mod verdict;
mod view;
mod warm_up;
mod work;

pub use self::warm_up::{
    ReferenceUse, WarmUpBlock, WarmUpParameter, WarmUpPhase, WarmUpRateTest, WarmUpRequest, WarmUpSummary, WarmUpTest,
    estimate_warm_up,
};
pub use ::warm_up::{ChangeOptions, DriftOptions, TemperatureUse};
pub use calibrate::{
    CalibrateMethod, CalibrateRequest, CalibrationSummary, Certificate, CertificateRequest, CertifiedStation,
    CertifiedTarget, Conditions, CorrelationSummary, DecisionSummary, ExpandedUncertainty, GroupSummary, HeldOut,
    HeldOutCheck, HeldOutPart, InputDigest, NotoriousPair, Observed, OffsetModel, OffsetTableSummary, ParameterMap,
    ParameterSummary, RejectedObservation, TableDefaults, TestVerdict, calibrate,
};
pub use compare::{
    AbsoluteSummary, CloudAlignment, CloudComparison, CompareAlignment, CompareRequest, Comparison, DistanceHistogram,
    PlaneDistances, PoseComparison, PoseDifference, RelativeSummary, TrajectoryComparison, TrajectoryStatistics,
    compare,
};
pub use correction_record::CorrectionRecord;
pub use destination::RefusalFile;
pub use diff::{
    CalibrationDifference, CorrectionLine, DiffRequest, DriftLine, DriftPlace, ImageLine, JointLine, ParameterLine,
    PatternLine, PlaceLine, diff,
};
pub use drift::{DriftError, DriftSource, DriftTreatment, FrameRatePart, ViewDrift};
pub use error::{Error, Result};
pub use explain::{ExplainRequest, Explanation, FlagReason, StageLine, StagePart, explain};
pub use fixed_pattern::{FixedPatternRequest, FixedPatternSummary, PatternWall, estimate_pattern};
pub use inspect::{Inspection, inspect};
pub use network_plan::{CandidateSummary, NetworkPlanRequest, PlanSummary, PointSigma, plan_network};
pub use network_scene::{
    FieldSpec, MOST_SIGHTINGS, MOST_TARGETS, NetworkScene, PassiveSpec, SceneStation, SceneTarget, SightingSpec,
    simulate_network,
};
pub use noise::{NoiseBin, NoiseParameter, NoiseRequest, NoiseStation, NoiseSummary, SigmaBinSummary, estimate_noise};
pub use outcome::{AdjustmentFigures, FurtherPoint, Outcome, RefusedStage, StationPose};
pub use plan::{
    AdjustOptions, AmplitudeKind, AverageOptions, CorrectImagePointOptions, CorrectRangeOptions, DeconvolveOptions,
    DemodulateOptions, FlagOptions, FuseExposuresOptions, MixedPixels, MultipathOptions, MultipathTreatment,
    NetworkCalibration, NoiseOptions, Plan, PointCloudOptions, RegisterOptions, RepairWrapsOptions, SimulateSource,
    Source, Stage, StartPoses, UnwrapMethod, UnwrapOptions,
};
pub use progress::{Progress, Silent};
pub use register::{
    RegisterMethod, RegisterRequest, RegisterSummary, RegisteredLoop, RegisteredPair, RegisteredPlacement,
    RegisteredStation, register,
};
pub use results::OwnCloud;
pub use run::{RunRequest, process, run};
pub use scattering::{
    CandidateGaussians, ScatteringCapture, ScatteringParameter, ScatteringRequest, ScatteringSummary,
    estimate_scattering,
};
pub use scattering_deconvolution::{EstimationOptions, TermCount, TermShape};
pub use self_calibration::{CalibrationOptions, CandidateGrid, Method, NetworkDatum, PlanOptions, TermSelection};
pub use sensor_noise::{NoiseFitOptions, PatternOptions};
pub use simulate::{Simulated, simulate};
pub use summary::{
    PairSummary, ReferenceSummary, RegistrationSummary, StageSummary, StationTruth, Summary, TruthSummary,
};
pub use track::{TrackLoss, TrackRequest, TrackSummary, TrackTruth, TrackVerdict, TrackedFrame, track};
pub use trends::{RemainingErrors, TrendSummary};
pub use truth::{RangeTruth, ViewTruth};
pub use verdict::{Doubt, DoubtKind, Failure, Judged, Verdict};
pub use view::{Snapshot, View, ViewData};
