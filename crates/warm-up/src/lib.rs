#![doc = include_str!("../README.md")]

mod captures;
mod error;
mod estimate;
mod fit;
mod fitting;
mod jump;
mod options;
mod rates;
mod transient_test;
mod verdict;

pub use adjust;
pub use captures::blocks::DriftBlock;
pub use captures::pixels::{ChangeMeter, ChangeOptions, PixelMeans, RangeChange};
pub use captures::sample::DriftSample;
pub use error::{DriftError, DriftResult};
pub use error_models;
pub use estimate::{DriftEstimate, estimate_drift, estimate_drift_at_rates};
pub use nalgebra;
pub use options::{DriftOptions, TemperatureUse};
pub use range_image;
pub use transient_test::{FrameRateTest, TransientTest};
pub use verdict::DriftVerdict;
