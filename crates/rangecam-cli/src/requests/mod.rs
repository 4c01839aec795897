//! Arguments of the commands, one module each.

pub(crate) mod calibration;
pub(crate) mod clouds;
pub(crate) mod fixed_pattern_arguments;
pub(crate) mod fleet;
pub(crate) mod frames;
pub(crate) mod noise_arguments;
pub(crate) mod orient_arguments;
pub(crate) mod register_arguments;
pub(crate) mod scattering_arguments;
pub(crate) mod values;
pub(crate) mod warm_up_arguments;
