//! What is unknown: blocks of values, their manifolds and names.

pub(crate) mod block;
pub(crate) mod block_id;
pub(crate) mod manifold;
pub(crate) mod rigid_pose;
