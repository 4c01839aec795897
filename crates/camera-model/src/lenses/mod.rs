//! Distortion of the lens and its inverse.

pub(crate) mod lens;
#[cfg(feature = "convert")]
pub(crate) mod lens_fit;
pub(crate) mod lens_inverse;
#[cfg(feature = "convert")]
pub(crate) mod plumb_bob;
#[cfg(feature = "convert")]
pub(crate) mod rational;
