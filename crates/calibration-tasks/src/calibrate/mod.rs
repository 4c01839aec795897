//! Calibration of a survey: tables or frames in, calibration, tables, summary and report out.

pub(crate) mod camera_files;
pub(crate) mod document;
pub(crate) mod figures;
pub(crate) mod network;
pub(crate) mod planes;
pub(crate) mod point_uncertainty;
pub(crate) mod request;
pub(crate) mod results;
pub(crate) mod run;
pub(crate) mod start;
pub(crate) mod surfaces;

pub use camera_files::CameraFiles;
pub use planes::offset::OffsetTableSummary;
pub use request::{CalibrateMethod, CalibrateRequest, CertificateRequest, OffsetModel, TableDefaults};
pub use results::certificate::{
    Certificate, CertifiedStation, CertifiedTarget, Conditions, ExpandedUncertainty, HeldOut, HeldOutCheck,
    HeldOutPart, InputDigest, NotoriousPair, Observed, TestVerdict,
};
pub use results::summary::{
    CalibrationSummary, CorrelationSummary, DecisionSummary, GroupSummary, ParameterMap, ParameterSummary,
    RejectedObservation,
};
pub use run::calibrate;

pub(crate) use network::distances::named_distances;
pub(crate) use planes::offset::FoundTable;
pub(crate) use results::calibration_file;
pub(crate) use results::certificate::{COVERAGE, is_notorious, notorious_pairs};
pub(crate) use results::words::{readable, value_words};
pub(crate) use start::Start;
pub(crate) use surfaces::calibrate_on_the_job;
