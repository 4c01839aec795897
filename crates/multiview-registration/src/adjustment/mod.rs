//! All stations in one system, round by round.

pub(crate) mod equations;
pub(crate) mod network;
pub(crate) mod precision;
pub(crate) mod rounds;
pub(crate) mod simultaneous;
pub(crate) mod turns;
