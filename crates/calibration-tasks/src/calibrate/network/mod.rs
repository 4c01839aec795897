//! The tables of a network of targets.

pub(crate) mod distances;
pub(crate) mod network_check;
pub(crate) mod network_files;
pub(crate) mod passive;
