#![doc = include_str!("../README.md")]

mod document;
mod figures;
mod fuse;
mod fused_result;
mod measure;
mod measured;
mod plan;
mod request;
mod result;
mod seen;
mod summary;

pub use commands;
pub use common_errors::{self, CommonErrorsFile, FrameErrors, SharedBySensor};
pub use fuse::{
    ApartSummary, ContradictionSummary, Correction, CountedPoints, FuseSummary, SharedErrorSummary, SigmaSummary,
    ThicknessSummary, fuse,
};
pub use fusion;
pub use measure::measure;
pub use measurement;
pub use plan::{Length, LengthKind, MeasurePlan, NamedRegion};
pub use point_uncertainty;
pub use range_io;
pub use request::{FuseRequest, MeasureRequest};
pub use summary::{FlatnessSummary, LengthSummary, MeasureSummary, MissingCells, RegionSummary, SigmaWithout};
