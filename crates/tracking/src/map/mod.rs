//! The surfaces of all keyframes as one cloud in bounded memory.

pub(crate) mod options;
pub(crate) mod surfaces;
mod surfel;
