//! Planning of a calibration network: how well it would determine the calibration, and what to add.

mod files;
mod run;
mod summary;

pub use run::{NetworkPlanRequest, plan_network};
pub use summary::{CandidateSummary, PlanSummary, PointSigma};
