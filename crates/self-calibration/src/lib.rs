#![doc = include_str!("../README.md")]

mod calibrate;
mod choice;
mod contradictions;
mod error;
mod findings;
mod methods;
mod options;
mod outliers;
mod planning;

pub use adjust::{GlobalTest, GlobalVerdict, Scale};
pub use calibrate::{calibrate, calibrate_two_networks};
pub use calibration_network::{
    AdjustedStation, AdjustedTarget, CalibratedParameter, Component, DistanceEnd, Error as NetworkError, GroupQuality,
    KnownDistance, Network, NetworkTarget, ObservationQuality, OutsideImage, PassiveCamera, PassiveImagePoint,
    Sighting, SightingOptions, SimulatedStart, Station, Verdict, simulate_sightings,
};
pub use error::Error;
pub use findings::contradiction::{Cause, CauseKind, Contradiction, WorstValue};
pub use findings::outcome::{CalibrationOutcome, TermDecision, TermScore, outcome};
pub use options::{CalibrationOptions, Method, NetworkDatum, TermSelection};
pub use outliers::rejection::solve_rig_rejecting;
pub use planning::hold_out::{HoldOut, Prediction, hold_out, range_difference};
pub use planning::plan::{Candidate, CandidateGrid, PlanOptions, PlanOutcome, plan};
// Of the signatures.
pub use {adjust, calibration_network, camera_model, error_models, nalgebra, orientation, range_calibration};

use error::Result;
