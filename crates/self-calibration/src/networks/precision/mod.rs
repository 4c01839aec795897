//! Deviations of the result: parameters, residuals, reference ranges, points, tests of groups.

pub(crate) mod global_tests;
pub(crate) mod point_sigma;
pub(crate) mod quality;
pub(crate) mod reference;
pub(crate) mod report;
