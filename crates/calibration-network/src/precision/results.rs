//! Values with their deviations: calibration parameters, poses, points, observed values, groups of these.

use error_models::ParameterStatus;
use nalgebra::{Isometry3, Matrix3, Matrix6, Point3};

use crate::functional_model::Component;

/// One calibration parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibratedParameter {
    /// Canonical name.
    pub name: String,
    /// Value in [`Self::unit`].
    pub value: f64,
    /// Standard deviation from the a-priori deviations of the observations; 0 where held.
    pub sigma_prior: f64,
    /// The same scaled with sigma0; 0 where held, NaN without redundancy.
    pub sigma_posterior: f64,
    /// Unit.
    pub unit: String,
    /// Estimated or held.
    pub status: ParameterStatus,
    /// Probability of a deviation from zero this large if the parameter were zero; NaN where held.
    pub significance_p: f64,
}

/// An adjusted station.
#[derive(Debug, Clone, PartialEq)]
pub struct AdjustedStation {
    /// Name.
    pub name: String,
    /// Pose.
    pub world_from_camera: Isometry3<f64>,
    /// Prior-scaled covariance of the tangent step `[dt world m, dθ camera rad]`.
    pub covariance: Matrix6<f64>,
}

/// An adjusted target.
#[derive(Debug, Clone, PartialEq)]
pub struct AdjustedTarget {
    /// Name.
    pub name: String,
    /// Position, metre.
    pub point: Point3<f64>,
    /// Prior-scaled covariance, m².
    pub covariance: Matrix3<f64>,
}

/// What the outlier test says of an observation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Verdict {
    /// Used, inconspicuous.
    Used,
    /// Rejected as a gross error; its residual is that of a prediction.
    Rejected,
    /// Used, but nothing checks it (redundancy number zero).
    Uncontrolled,
    /// Left out as the method or the user asks; its residual is that of a prediction.
    LeftOut,
}

/// An observed value after the adjustment.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservationQuality {
    /// Name of the station (of the first end of a distance).
    pub station: String,
    /// Name of the target (of the second end of a distance).
    pub target: String,
    /// Which component.
    pub component: Component,
    /// Observed value in the unit of the component.
    pub observed: f64,
    /// A-priori standard deviation, same unit.
    pub sigma: f64,
    /// v = observed − model, same unit.
    pub residual: f64,
    /// Redundancy number 0..1; NaN where the observation is not used.
    pub redundancy_number: f64,
    /// `v / σ_v`, posterior-scaled where there is redundancy; NaN where not controlled.
    pub standardised: f64,
    /// Smallest gross error that the test would find (internal reliability), same unit; infinite where uncontrolled.
    pub smallest_detectable: f64,
    /// Verdict.
    pub verdict: Verdict,
    /// Image point of the sighting (col, row), pixel, for plots; NaN where there is none.
    pub pixel: [f64; 2],
    /// Observed range of the sighting, metre; NaN where there is none.
    pub range_m: f64,
    /// Amplitude of the sighting; NaN where there is none.
    pub amplitude: f64,
    /// For ranges: observed range minus distance between adjusted points, without any range term taken off, metre: the
    /// error before calibration. NaN for other components.
    pub uncorrected_m: f64,
}

/// Figures of an observation group.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupQuality {
    /// Name: `col`, `row`, `range`, ...
    pub name: String,
    /// Observed values.
    pub observations: usize,
    /// Part of the redundancy.
    pub redundancy: f64,
    /// Root mean square of the residuals, unit of the group.
    pub rms: f64,
    /// `√(vᵀPv / redundancy)` of the group, the first estimate of its variance component: how much larger its standard
    /// deviations seem to be than they were given.
    pub sigma0: Option<f64>,
}
