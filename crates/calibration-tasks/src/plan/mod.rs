//! Planning of a calibration network: how well it would determine the calibration, and what to add.

pub(crate) mod document;
pub(crate) mod files;
pub(crate) mod run;
pub(crate) mod summary;

pub use run::{NetworkPlanRequest, plan_network};
pub use summary::{CandidateSummary, PlanSummary, PointSigma};
