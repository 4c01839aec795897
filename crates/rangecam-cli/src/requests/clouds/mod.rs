//! Arguments of what works on clouds and results.

pub(crate) mod colour_arguments;
pub(crate) mod compare_arguments;
pub(crate) mod fuse_arguments;
pub(crate) mod measure_arguments;
