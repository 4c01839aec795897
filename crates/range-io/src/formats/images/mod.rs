//! Files of one image.

#[cfg(feature = "grey")]
pub mod grey;
#[cfg(feature = "png16")]
pub mod png16;
