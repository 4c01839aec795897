//! Arguments of what works on clouds.

pub(crate) mod colour_arguments;
pub(crate) mod fuse_arguments;
pub(crate) mod measure_arguments;
