//! A frame made ready once: nodes, planes, and the pixel that a direction falls on.

pub(crate) mod bits;
pub(crate) mod blocks;
pub(crate) mod frame;
pub(crate) mod grid;
pub(crate) mod legendre;
pub(crate) mod node_table;
pub(crate) mod nodes;
pub(crate) mod planes;
pub(crate) mod projection;
pub(crate) mod table;
