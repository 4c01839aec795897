//! Gross errors of observations and of control.

pub(crate) mod control_test;
pub(crate) mod rejection;
