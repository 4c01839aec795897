#![doc = include_str!("../README.md")]

mod calibrate;
mod check;
mod diff;
mod plan;
mod run;
mod scene;

pub use calibrate::{
    CalibrateMethod, CalibrateRequest, CalibrationSummary, CameraFiles, Certificate, CertificateRequest,
    CertifiedStation, CertifiedTarget, Conditions, CorrelationSummary, DecisionSummary, ExpandedUncertainty,
    GroupSummary, HeldOut, HeldOutCheck, HeldOutPart, InputDigest, NotoriousPair, Observed, OffsetModel,
    OffsetTableSummary, ParameterMap, ParameterSummary, RejectedObservation, TableDefaults, TestVerdict, calibrate,
};
pub use check::{CalibrationCheck, CheckRequest, check};
pub use diff::{
    CalibrationDifference, CorrectionLine, DiffRequest, DriftLine, DriftPlace, ImageLine, JointLine, ParameterLine,
    PatternLine, PlaceLine, diff,
};
pub use pipeline;
pub use plan::{CandidateSummary, NetworkPlanRequest, PlanSummary, PointSigma, plan_network};
pub use run::run;
pub use scene::{
    FieldSpec, MOST_SIGHTINGS, MOST_TARGETS, NetworkScene, PassiveSpec, SceneStation, SceneTarget, SightingSpec,
    simulate_network,
};
pub use self_calibration::{CalibrationOptions, CandidateGrid, Method, NetworkDatum, PlanOptions, TermSelection};
