//! Poses and the registrations between them, adjusted together: the keyframes of a path, and stations.

mod adjustment;
mod graph;
mod relation;
mod uncertain;

pub(crate) use graph::{Edge, Graph, is_likely};
pub(crate) use relation::Relation;
pub(crate) use uncertain::{Uncertain, product_jacobians};
