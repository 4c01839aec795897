//! What is unknown: blocks of values, their manifolds and names.

pub(crate) mod block;
pub(crate) mod differentiation;
pub(crate) mod ids;
pub(crate) mod manifold;
pub(crate) mod rigid_pose;
