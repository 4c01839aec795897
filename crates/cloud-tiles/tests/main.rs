//! Clouds written in tiles and read back.
#![allow(clippy::unwrap_used, clippy::float_cmp, missing_docs)]

mod read;
mod refusals;
mod tiles;
