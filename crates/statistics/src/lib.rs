#![doc = include_str!("../README.md")]

mod distributions;
mod multiple_tests;
mod order;
mod robust_scale;
mod thinning;

pub use distributions::{Distribution, chi_squared_limit};
pub use multiple_tests::{bonferroni, holm};
pub use order::{Number, quantile, ranked, upper_median};
pub use robust_scale::{CHI_MEDIANS, SIGMA_OF_MAD, mad_scale, retain_within, robust_standard_deviation};
pub use thinning::Thinning;
