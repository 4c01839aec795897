//! Arguments of what takes many recordings.

pub(crate) mod fleet_arguments;
pub(crate) mod merge_arguments;
pub(crate) mod part;
pub(crate) mod workflow_arguments;
