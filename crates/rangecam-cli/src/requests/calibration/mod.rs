//! Arguments of what makes calibrations, and of what compares them.

pub(crate) mod calibrate_arguments;
pub(crate) mod check_arguments;
pub(crate) mod diff_arguments;
pub(crate) mod plan_arguments;
pub(crate) mod targets_arguments;
