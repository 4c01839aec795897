#![doc = include_str!("../README.md")]

mod find;
mod kind;
mod print;

pub use find::{LeftOut, MissingStation, StationSummary, TargetsRequest, TargetsSummary, find_targets};
pub use kind::{BoardKind, SingleKind, TargetKind};
pub use print::{PrintRequest, PrintSummary, print_targets};
pub use {pipeline, targets};
