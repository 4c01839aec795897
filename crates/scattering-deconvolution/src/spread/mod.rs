//! The point spread function and its parts.

pub(crate) mod composite;
pub(crate) mod field;
pub(crate) mod options;
pub(crate) mod psf;
