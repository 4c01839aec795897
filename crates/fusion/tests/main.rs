//! Fused points.

#![allow(clippy::unwrap_used, clippy::float_cmp)]

mod common;
mod input;
mod shared_error;
mod truth;
mod walls;
