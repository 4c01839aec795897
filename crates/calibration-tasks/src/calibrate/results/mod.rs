//! What is written of a calibration.

pub(crate) mod calibration_file;
pub(crate) mod carried;
pub(crate) mod certificate;
pub(crate) mod names;
pub(crate) mod summary;
pub(crate) mod tables;
pub(crate) mod trends;
pub(crate) mod words;
