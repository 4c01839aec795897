//! Its convolution: kernels, spectra and operators.

pub(crate) mod blobs;
pub(crate) mod convolution;
pub(crate) mod grid;
pub(crate) mod interpolation;
pub(crate) mod kernel;
pub(crate) mod lanes;
pub(crate) mod operator;
pub(crate) mod parts;
pub(crate) mod spectrum;
