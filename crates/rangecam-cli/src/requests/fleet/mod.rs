//! Arguments of what takes many recordings.

#[cfg(feature = "every-command")]
pub(crate) mod fleet_arguments;
pub(crate) mod merge_arguments;
pub(crate) mod part;
#[cfg(feature = "every-command")]
pub(crate) mod workflow_arguments;
