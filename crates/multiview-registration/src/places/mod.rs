//! Whether stations, or all beyond a joint of the network, fit better in another place than where the adjustment has them.

pub(crate) mod joints;
pub(crate) mod search;
pub(crate) mod sought;
