//! Arguments of what works on the cloud of a result.

pub(crate) mod fuse_arguments;
pub(crate) mod measure_arguments;
