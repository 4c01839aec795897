//! All stations in one system, round by round.

pub(crate) mod cofactors;
pub(crate) mod equations;
pub(crate) mod joint_covariance;
pub(crate) mod known;
pub(crate) mod network;
pub(crate) mod precision;
pub(crate) mod relaxation;
pub(crate) mod rounds;
pub(crate) mod simultaneous;
pub(crate) mod turns;
pub(crate) mod wide_errors;
