//! Taking range errors off, and putting them on.

pub(crate) mod chunks;
pub(crate) mod correct;
pub(crate) mod distort;
pub(crate) mod interpolated;
pub(crate) mod inverse;
pub(crate) mod kernel;
pub(crate) mod kernel_further;
pub(crate) mod kernel_sines;
pub(crate) mod kernel_tally;
pub(crate) mod prepared;
pub(crate) mod range_error;
