//! Errors that change with time, temperature and frame rate.

pub(crate) mod frame_rate;
pub(crate) mod rate_history;
pub(crate) mod warm_up;
