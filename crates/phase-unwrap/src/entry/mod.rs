//! What users call for one frequency.

pub(crate) mod noisy;
pub(crate) mod noisy_absolute;
pub(crate) mod repair;
pub(crate) mod spatial;
pub(crate) mod temporal;
