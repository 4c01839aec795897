#![doc = include_str!("../README.md")]

mod find;
mod kind;

pub use find::{BoardSummary, MissingBoard, TargetsRequest, TargetsSummary, find_targets};
pub use kind::TargetKind;
pub use {pipeline, targets};
