//! Many stations: which of them overlap, and all their poses at once.

mod blind;
mod check;
mod contacts;
mod datum;
mod elimination;
mod equations;
mod facets;
mod grouping;
mod loops;
mod network;
mod overlap;
mod pairs;
mod patches;
mod plane_fit;
mod point_model;
mod point_residuals;
mod points;
mod pose_graph;
mod precision;
mod reduction;
mod regions;
mod registration;
mod rounds;
mod scatter;
mod sightings;
mod simultaneous;
mod stations;
mod sums;
mod surfaces;
mod tiles;

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
