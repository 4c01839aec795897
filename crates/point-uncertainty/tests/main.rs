//! Errors of points.

#![allow(clippy::unwrap_used, clippy::float_cmp)]

mod derivatives;
mod propagation;
