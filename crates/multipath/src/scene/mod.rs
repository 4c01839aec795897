//! Light that bounces between the surfaces of a scene.

pub(crate) mod bending;
pub(crate) mod contradiction;
pub(crate) mod detect;
pub(crate) mod patches;
pub(crate) mod radiosity;
pub(crate) mod risk;
