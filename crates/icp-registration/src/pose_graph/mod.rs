//! Poses and the registrations between them, adjusted together: the keyframes of a path, and stations.

mod adjustment;
mod graph;
mod relation;

#[cfg(feature = "multiview")]
pub(crate) use graph::is_likely;
pub(crate) use graph::{Edge, Graph};
pub(crate) use relation::Relation;
