//! How a network is calibrated.

/// The methods of Sect. 5.3.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Lens, range terms, poses and object points in one adjustment.
    OneStep,
    /// Lens from one network of image points, range terms from reference ranges of another facility.
    TwoStepIndependent,
    /// Lens and poses from the image points, then range terms from the reference ranges that these give.
    TwoStepDependent,
    /// With a passive camera: its poses carry the range camera's, then range terms from reference ranges.
    JointTwoStep,
    /// With a passive camera in one adjustment, the relative orientation being one unknown for all epochs.
    JointIntegrated,
    /// Range terms from distances known from outside (a track or a baseline).
    Laboratory,
}

/// Which terms are estimated.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum TermSelection {
    /// All, each with what cameras show of it as an observation of zero: waves and tilt of the range error with a standard
    /// deviation of 2 cm, radial lens terms of 20, 10, 5 % and decentring ones of 1 % of the corner's radius, b1 and b2 of
    /// 0.001. A hyperbola or a spline is taken by Schwarz's criterion.
    Auto,
    /// These, by their canonical names (`xp yp c k1 k2 k3 p1 p2 b1 b2 d0 d2..d7 e1 e2 h1 h2 h3`, and those of further
    /// terms that the range model has); all others are held. `splineN`, `polynomialN` and `surfaceN` stand for all terms
    /// of such a model, which the calibration then has: see [`calibrate`](crate::calibrate).
    List(Vec<String>),
}

/// What carries the datum.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NetworkDatum {
    /// Inner constraints on the object points (Eq. 22).
    #[default]
    Free,
    /// Weighted control: targets or stations with given standard deviations.
    Control,
}

/// Options of a network calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationOptions {
    /// Method.
    pub method: Method,
    /// Terms.
    pub terms: TermSelection,
    /// Datum.
    pub datum: NetworkDatum,
    /// Stations whose ranges are left out, by name (convergent ones, whose ranges scattering would bias).
    pub without_ranges: Vec<String>,
    /// Significance level of the outlier test (data snooping, one at a time); `None`: nothing is rejected. Default 0.0001.
    pub rejection_level: Option<f64>,
    /// A combination of parameters that is known so many times worse than its parameters would be alone is refused as
    /// not determined.
    pub largest_inflation: f64,
}
