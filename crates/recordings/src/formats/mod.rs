//! One module a format.

#[cfg(feature = "adi")]
pub(crate) mod adi;
#[cfg(feature = "bag")]
pub(crate) mod bag;
#[cfg(any(feature = "mcap", feature = "bag"))]
mod chunk;
#[cfg(feature = "mcap")]
pub(crate) mod mcap;
#[cfg(feature = "mkv")]
pub(crate) mod mkv;
