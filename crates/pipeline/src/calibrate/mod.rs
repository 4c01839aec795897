//! Calibration of a survey: tables or frames in, calibration, tables, summary and report out.

mod calibration_file;
mod carried;
mod certificate;
mod control;
mod distances;
mod drift;
mod names;
mod network_check;
mod network_files;
mod offset;
mod passive;
mod placed;
mod planes;
mod planes_outcome;
mod pose_test;
mod request;
mod run;
mod start;
mod summary;
mod tables;
mod trends;
mod words;

pub use certificate::{
    Certificate, CertifiedStation, CertifiedTarget, Conditions, ExpandedUncertainty, HeldOut, HeldOutCheck,
    HeldOutPart, InputDigest, NotoriousPair, Observed, TestVerdict,
};
pub use offset::{OffsetModel, OffsetTableSummary};
pub use request::{CalibrateMethod, CalibrateRequest, CertificateRequest, TableDefaults};
pub use run::calibrate;
pub use summary::{
    CalibrationSummary, CorrelationSummary, DecisionSummary, GroupSummary, ParameterMap, ParameterSummary,
    RejectedObservation,
};

pub(crate) use calibration_file::UNKNOWN_INTEGRATION_TIME_S;
pub(crate) use certificate::{COVERAGE, is_notorious, notorious_pairs};
pub(crate) use control::pose_covariance;
pub(crate) use distances::named_distances;
pub(crate) use offset::FoundTable;
pub(crate) use start::Start;
pub(crate) use words::{readable, value_words};
