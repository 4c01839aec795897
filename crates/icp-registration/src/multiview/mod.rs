//! Many stations: which of them overlap, and all their poses at once.

mod overlap;
mod pose_graph;
mod surfaces;

pub use overlap::{Overlap, find_overlaps};
pub use pose_graph::{
    Datum, PairConstraint, PairResidual, StationAdjustment, StationAdjustmentOptions, adjust_stations,
};
pub use surfaces::{
    PairAlignment, RefusedPair, SurfaceAdjustment, SurfaceAdjustmentOptions, adjust_surfaces, align_pairs,
};
