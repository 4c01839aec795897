//! Deviations of an adjusted network: parameters, residuals, groups, points.

pub(crate) mod point_sigma;
pub(crate) mod quality;
pub(crate) mod report;
pub(crate) mod results;

pub use point_sigma::point_sigma;
pub use quality::{Figures, Geometry, amplitude_classes, groups, noncentrality};
pub use report::{Estimate, Fit, covariance_of, models, parameters, set_spans};
pub use results::{AdjustedStation, AdjustedTarget, CalibratedParameter, GroupQuality, ObservationQuality, Verdict};
