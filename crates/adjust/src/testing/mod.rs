//! Statistical tests: outliers, variance components, significance, reliability.

pub(crate) mod global_test;
pub(crate) mod outlier;
pub(crate) mod readmission;
pub(crate) mod reliability;
pub(crate) mod significance;
pub(crate) mod snooping;
pub(crate) mod sweep;
pub(crate) mod variance_components;
