//! Many stations: which of them overlap, and all their poses at once.

mod alignments;
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
mod noise;
mod pairs;
mod patch_size;
mod patches;
mod placement;
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
mod shared_errors;
mod sightings;
mod simultaneous;
mod stations;
mod sums;
mod tiles;
mod wide_errors;

pub use alignments::{PairAlignment, RefusedPair};
pub use loops::LoopClosure;
pub use placement::{PairAgreement, Placement, Placements, StationPlacement, judge_placements};
pub use point_model::{PointModel, SharedParameters};
pub use pose_graph::{
    Datum, PairConstraint, PairResidual, StationAdjustment, StationAdjustmentOptions, adjust_stations,
};
pub use registration::{Start, StationRegistration, StationRegistrationOptions, SurfacePair, UndeterminedStation};
pub use stations::register_stations;
