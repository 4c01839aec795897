//! Images, channels, flags and modulation.

pub(crate) mod channel;
pub(crate) mod flags;
pub(crate) mod frame;
pub(crate) mod image_format;
pub(crate) mod modulation;
pub(crate) mod noise;
pub(crate) mod options;
pub(crate) mod phase_level;
pub(crate) mod polar;
pub(crate) mod raster;
pub(crate) mod wide;
