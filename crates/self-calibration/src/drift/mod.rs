//! Drift of all ranges while a camera warms up, from frames of a scene at rest (Sect. 4.7).

mod blocks;
mod curve;
mod error;
mod estimate;
mod fit;
mod jump;
mod options;
mod pixels;
mod projection;
mod rates;
mod sample;
mod transient_test;
mod verdict;
mod whitening;

pub use blocks::DriftBlock;
pub use error::{DriftError, DriftResult};
pub use estimate::{DriftEstimate, estimate_drift, estimate_drift_at_rates};
pub use options::{DriftOptions, TemperatureUse};
pub use pixels::{ChangeMeter, ChangeOptions, PixelMeans, RangeChange};
pub use sample::DriftSample;
pub use transient_test::{FrameRateTest, TransientTest};
pub use verdict::DriftVerdict;
