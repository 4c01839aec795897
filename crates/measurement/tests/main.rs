//! Lengths from regions of a cloud.

#![allow(clippy::unwrap_used, clippy::float_cmp, clippy::panic)]

mod coverage;
mod fits;
mod gradients;
mod regions;
mod scene;
mod statistics;
mod volumes;
