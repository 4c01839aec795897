#![doc = include_str!("../README.md")]

pub mod run;
pub mod stages;
pub mod stations;
pub mod survey;
pub mod trends;
pub use commands;
pub use commands::plan::{
    AdjustOptions, AmplitudeKind, AverageOptions, CorrectImagePointOptions, CorrectRangeOptions, DeconvolveOptions,
    DemodulateOptions, DriftTreatment, FlagOptions, FuseExposuresOptions, MixedPixels, MultipathOptions,
    MultipathTreatment, NetworkCalibration, NoiseOptions, Plan, PointCloudOptions, RegisterOptions, RepairWrapsOptions,
    SimulateSource, Source, Stage, StartPoses, UnwrapMethod, UnwrapOptions,
};
pub use commands::{
    Doubt, DoubtKind, DriftError, Error, Failure, Judged, Progress, RefusalFile, Result, Silent, Verdict,
};
pub use run::{
    Calibrator, OwnCloud, PairSummary, Part, PartSummary, Processed, ReferenceSummary, RegistrationSummary, RunRequest,
    Simulated, StationTruth, Summary, TruthSummary, merge, process, process_each, run, run_part, run_with, simulate,
};
pub use survey::{
    AdjustmentFigures, CorrectionRecord, DriftSource, FrameRatePart, FurtherPoint, RangeTruth, RefusedStage, Snapshot,
    StageSummary, StationPose, View, ViewData, ViewDrift, ViewRecord, ViewTruth,
};
pub use trends::{RemainingErrors, TrendSummary};
