//! Frames as stations: pairs by projection, and one graph of their poses.

pub(crate) mod frame_graph;
pub(crate) mod frame_pairs;
pub(crate) mod frame_scale;
pub(crate) mod frames;
