//! Many stations: which of them overlap, and all their poses at once.

mod blind;
mod contacts;
mod datum;
mod grouping;
mod loops;
mod network;
mod overlap;
mod pairs;
mod patches;
mod plane_fit;
mod point_model;
mod point_residuals;
mod pose_graph;
mod precision;
mod reduction;
mod registration;
mod rounds;
mod start;
mod stations;
mod surfaces;

pub use loops::LoopClosure;
pub use overlap::{Overlap, find_overlaps};
pub use point_model::{PointModel, SharedParameters};
pub use pose_graph::{
    Datum, PairConstraint, PairResidual, StationAdjustment, StationAdjustmentOptions, adjust_stations,
};
pub use registration::{Start, StationRegistration, StationRegistrationOptions, SurfacePair, UndeterminedStation};
pub use stations::register_stations;
pub use surfaces::{
    PairAlignment, RefusedPair, SurfaceAdjustment, SurfaceAdjustmentOptions, adjust_surfaces, align_pairs,
};
