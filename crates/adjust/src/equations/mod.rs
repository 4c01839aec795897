//! Normal equations: their structure, elimination, constraints and datum.

pub(crate) mod block_normal;
pub(crate) mod border;
pub(crate) mod constraints;
pub(crate) mod datum;
pub(crate) mod elimination;
pub(crate) mod graph;
pub(crate) mod normal;
pub(crate) mod orthogonal;
pub(crate) mod reduced_constraints;
pub(crate) mod structure;
pub(crate) mod system;
