//! Arguments of the commands, one module each.

#[cfg(feature = "every-command")]
pub(crate) mod calibration;
#[cfg(feature = "every-command")]
pub(crate) mod clouds;
#[cfg(feature = "every-command")]
pub(crate) mod fixed_pattern_arguments;
pub(crate) mod fleet;
#[cfg(feature = "every-command")]
pub(crate) mod frames;
#[cfg(feature = "every-command")]
pub(crate) mod noise_arguments;
#[cfg(feature = "every-command")]
pub(crate) mod orient_arguments;
#[cfg(feature = "every-command")]
pub(crate) mod register_arguments;
#[cfg(feature = "every-command")]
pub(crate) mod scattering_arguments;
pub(crate) mod values;
#[cfg(feature = "every-command")]
pub(crate) mod warm_up_arguments;
