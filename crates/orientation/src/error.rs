/// Why a station could not be oriented.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Not enough targets.
    #[error("a resection needs at least {needed} targets, {found} were given")]
    TooFewTargets {
        /// Targets given.
        found: usize,
        /// Targets needed.
        needed: usize,
    },
    /// The targets lie on one line (or in one point): the turn about it is not determined.
    #[error("the targets lie on one line: they extend across it by {ratio:.1e} of their length")]
    CollinearTargets {
        /// Extent across the line over extent along it.
        ratio: f64,
    },
    /// A number given for a target cannot be used.
    #[error("target {target}: {name} = {value}: {expected}")]
    InvalidTarget {
        /// Position of the target in the list.
        target: usize,
        /// Which number.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// No pose was found from which all targets lie in front of the camera.
    #[error(
        "no pose was found that sees all {targets} targets in front of the camera: a target may be mistaken for another"
    )]
    NoApproximation {
        /// Number of targets.
        targets: usize,
    },
    /// Several poses explain the observations equally well.
    #[error(
        "{} poses explain the observations equally well (v'Pv differs by {difference:.2}): \
         another target, a range or an approximate pose decides", .poses.len()
    )]
    Ambiguous {
        /// The poses `world_from_camera`, best first.
        poses: Vec<nalgebra::Isometry3<f64>>,
        /// By how much the second `v'Pv` is larger than the first.
        difference: f64,
    },
    /// The pose is determined so weakly that its covariance, which comes from a linearisation, means nothing.
    #[error(
        "the geometry is too weak: with standard deviations of {sigma_attitude_rad:.3} rad and {sigma_position_m:.3} m \
         the linearisation misses {curvature:.1} times the change that it describes; \
         targets further apart, off one plane, or with ranges help"
    )]
    WeakGeometry {
        /// Largest standard deviation of the attitude, radian.
        sigma_attitude_rad: f64,
        /// Largest standard deviation of the position, metre.
        sigma_position_m: f64,
        /// See [`crate::Resection::curvature`].
        curvature: f64,
    },
    /// The camera's parameters are not valid.
    #[error(transparent)]
    Camera(#[from] camera_model::Error),
    /// The adjustment failed.
    #[error("resection: {0}")]
    Adjustment(#[from] adjust::Error),
}

/// Result with this crate's [`enum@Error`].
pub(crate) type Result<T> = std::result::Result<T, Error>;
