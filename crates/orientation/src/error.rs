/// Why a station could not be oriented.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Not enough targets.
    #[error("at least {needed} targets are needed, {found} were given")]
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
        /// The poses, best first: `world_from_camera` of a resection, `first_from_second` of two views.
        poses: Vec<nalgebra::Isometry3<f64>>,
        /// By how much the second `v'Pv` is larger than the first.
        difference: f64,
    },
    /// No arrangement of the known targets explains the points better than chance.
    #[error(
        "{seen} points that were seen fit no arrangement of the {known} known targets: {expected_by_chance:.1e} would fit as well \
         as the best by chance; more points, other coordinates, an approximate pose or coded targets help"
    )]
    Unidentified {
        /// Points that were seen.
        seen: usize,
        /// Targets with coordinates.
        known: usize,
        /// How many arrangements would fit as well as the best by chance.
        expected_by_chance: f64,
    },
    /// The points fit the known targets in several ways.
    #[error(
        "the points that were seen fit the known targets in {ways} ways: an approximate pose, a target off the pattern or \
         coded targets decide"
    )]
    AmbiguousArrangement {
        /// In how many.
        ways: usize,
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
    /// Two lists of image points that belong together differ in length.
    #[error("{first} image points in the first view, {second} in the second: each target has one in both")]
    LengthMismatch {
        /// Image points of the first view.
        first: usize,
        /// Image points of the second.
        second: usize,
    },
    /// No relative pose agrees with at least half of the pairs of image points.
    #[error(
        "no relative pose agrees with more than {agreeing} of {pairs} pairs of image points: \
         targets may be mistaken for each other, or the standard deviations are too small"
    )]
    NoAgreement {
        /// Pairs that agree with the best pose.
        agreeing: usize,
        /// Pairs given.
        pairs: usize,
    },
    /// The views differ by a rotation alone, as far as the image points tell.
    #[error(
        "there is no base: a rotation alone explains the image points (v'Pv = {vtpv:.1}, by chance up to {limit:.1})"
    )]
    NoBase {
        /// `v'Pv` of the rotation alone.
        vtpv: f64,
        /// What it exceeds by chance once in a thousand.
        limit: f64,
    },
    /// The direction of the base is known too weakly for a covariance to describe it.
    #[error(
        "the base is too small: its direction has a standard deviation of {sigma_direction_rad:.2} rad; \
         stations further apart, nearer targets or more of them help"
    )]
    WeakBase {
        /// Largest standard deviation of the direction, radian.
        sigma_direction_rad: f64,
    },
    /// A station or target has a number that none of so many observations can have.
    #[error(
        "{what} number {number}: stations and targets are numbered from 0, and {observations} observations have no more"
    )]
    InvalidNumber {
        /// Station or target.
        what: &'static str,
        /// Its number.
        number: usize,
        /// How many observations there are.
        observations: usize,
    },
    /// A station shares too little with the others.
    #[error(
        "station {station} shares {shared} targets with what can be oriented; three with ranges are needed, or four image points"
    )]
    NotConnected {
        /// Its number.
        station: usize,
        /// Targets that it shares.
        shared: usize,
    },
    /// Not enough poses.
    #[error(
        "at least {needed} poses of the camera must lie within the carrier's trajectory, {found} do: check the times, and the longest gap"
    )]
    TooFewPoses {
        /// Poses that do.
        found: usize,
        /// Poses needed.
        needed: usize,
    },
    /// A pose that cannot be used.
    #[error("{what} pose {index}: {reason}")]
    InvalidPose {
        /// Whose pose.
        what: &'static str,
        /// Its number.
        index: usize,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// An option that cannot be.
    #[error("{name} = {value}: {expected}")]
    InvalidOption {
        /// Name of the option.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// The motions of the carrier leave a part of the mounting open.
    #[error("not determined by these motions: {}; more varied motions or a known lever arm help", listed(.undetermined))]
    UndeterminedMounting {
        /// What is open.
        undetermined: Vec<crate::Undetermined>,
    },
    /// No mounting makes carrier and camera agree.
    #[error(
        "no mounting fits more than {agreeing} of {poses} poses; carrier and camera turn by angles that typically differ by {angle_rad:.4} rad: \
         check units, left-handed axes, inverse poses, and times"
    )]
    PosesContradict {
        /// Poses that agree with the best.
        agreeing: usize,
        /// Poses given.
        poses: usize,
        /// Median difference of the angles by which carrier and camera turn between poses, radian.
        angle_rad: f64,
    },
    /// The camera's parameters are not valid.
    #[error(transparent)]
    Camera(#[from] camera_model::Error),
    /// The adjustment failed.
    #[error("resection: {0}")]
    Adjustment(#[from] adjust::Error),
}

fn listed(undetermined: &[crate::Undetermined]) -> String {
    undetermined.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}

/// Result with this crate's [`enum@Error`].
pub(crate) type Result<T> = std::result::Result<T, Error>;
