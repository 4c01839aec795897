//! Networks before they are observed, and predictions of what was not used.

pub(crate) mod hold_out;
pub(crate) mod plan;
