//! What can go wrong, with the value that was wrong.

/// Every error of this crate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Of a cloud, its neighbours or its normals.
    #[error(transparent)]
    Cloud(#[from] point_cloud::Error),
    /// Of a pose.
    #[error(transparent)]
    Pose(#[from] rigid_pose::Error),
    /// There is nothing to work on.
    #[error("{what} is empty")]
    Empty {
        /// Which input.
        what: &'static str,
    },
    /// A coordinate, weight or sigma is NaN, infinite or beyond ±1e100.
    #[error("{what}: entry {index} is not a finite number below 1e100")]
    NonFinite {
        /// Which input.
        what: &'static str,
        /// Its index, counted from 0.
        index: usize,
    },
    /// Many points lie at the origin, where cameras write points that they did not measure.
    #[error(
        "{what}: {found} of {of} points are (0, 0, 0), which cameras write where they measured nothing; leave them out"
    )]
    Unmeasured {
        /// Which input.
        what: &'static str,
        /// Points at the origin.
        found: usize,
        /// All points.
        of: usize,
    },
    /// A weight or sigma is negative (or zero where that has no meaning).
    #[error("{what}: entry {index} is {value}, which must be positive")]
    NotPositive {
        /// Which input.
        what: &'static str,
        /// Its index, counted from 0.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// A pair names a station that is not there.
    #[error("a pair names station {station}, but there are {count} (from 0)")]
    NoSuchStation {
        /// The index.
        station: usize,
        /// Number of stations.
        count: usize,
    },
    /// The simultaneous adjustment of the stations failed.
    #[error("adjustment of the stations: {0}")]
    Adjustment(String),
    /// Two inputs that belong together differ in length.
    #[error("{what} has {found} entries, {expected} were expected")]
    LengthMismatch {
        /// Which input.
        what: &'static str,
        /// Entries needed.
        expected: usize,
        /// Entries found.
        found: usize,
    },
    /// An option has a value outside its domain.
    #[error("option {name} is {value}; it must be {domain}")]
    InvalidOption {
        /// The option's field name.
        name: &'static str,
        /// Its value.
        value: f64,
        /// The values that are allowed.
        domain: &'static str,
    },
    /// Fewer points than the task needs.
    #[error("{what}: {found} usable points, at least {needed} are needed")]
    TooFewPoints {
        /// Which input.
        what: &'static str,
        /// Points found.
        found: usize,
        /// Points needed.
        needed: usize,
    },
    /// The points lie on one line (or in one place): the rotation about it is not determined.
    #[error("{what}: the points are collinear (second to first extent {ratio:.1e})")]
    Collinear {
        /// Which input.
        what: &'static str,
        /// Second principal extent divided by the first.
        ratio: f64,
    },
    /// Two different rotations fit the point pairs equally well.
    #[error("the rotation is ambiguous: the best two solutions differ by {gap:.1e} of the criterion")]
    AmbiguousRotation {
        /// Relative gap between the two largest eigenvalues.
        gap: f64,
    },
    /// Too few source points have a partner in the target.
    #[error(
        "{found} of {of} source points have a partner within {max_distance_m} m in iteration {iteration}, \
         at least {needed} are needed: no overlap, or the guess is too far off"
    )]
    TooFewCorrespondences {
        /// Pairs found.
        found: usize,
        /// Source points tried.
        of: usize,
        /// Pairs needed.
        needed: usize,
        /// Limit of the distance at that moment, metre.
        max_distance_m: f64,
        /// Iteration, counted from 0.
        iteration: usize,
    },
    /// A linear system or an eigenvalue problem could not be solved.
    #[error("{what} could not be solved: {why}")]
    Numerical {
        /// Which system.
        what: &'static str,
        /// The reason.
        why: &'static str,
    },
    /// The search tree refused its points.
    #[error("the search tree could not be built: {0}")]
    Tree(String),
    /// Times do not ascend.
    #[error("{what} do not ascend at entry {index}")]
    NotAscending {
        /// Which input.
        what: &'static str,
        /// Its index, counted from 0.
        index: usize,
    },
    /// A body said to rest did not.
    #[error(
        "the body moves: rates scatter by {rate_spread:.3} rad/s, specific forces by {force_spread:.3} m/s^2 about a \
         mean of {mean_force:.2} m/s^2"
    )]
    Moving {
        /// Largest standard deviation of a component of the rates, rad/s.
        rate_spread: f64,
        /// The same of the specific forces, m/s².
        force_spread: f64,
        /// Length of the mean specific force, m/s².
        mean_force: f64,
    },
    /// The inertial samples leave a gap.
    #[error("no inertial sample for {seconds} s after {from_s} s; {allowed_s} s are allowed")]
    NoInertialData {
        /// Where the gap begins, second.
        from_s: f64,
        /// Its length, second.
        seconds: f64,
        /// The longest allowed, second.
        allowed_s: f64,
    },
    /// Voxels of this size cannot be numbered in this cloud.
    #[error("voxels of {voxel_m} m in a cloud of {extent_m} m: the size must be positive, and above 1/2 000 000 of it")]
    VoxelSize {
        /// Edge of a voxel, metre.
        voxel_m: f64,
        /// Largest extent of the cloud along an axis, metre.
        extent_m: f64,
    },
    /// Two trajectories have no pose at the same time.
    #[error(
        "no pose of the estimate ({:.3} s to {:.3} s) has one of the truth ({:.3} s to {:.3} s) within {tolerance_s} s",
        .estimate_s[0], .estimate_s[1], .truth_s[0], .truth_s[1]
    )]
    NoCommonTime {
        /// Largest difference of the times, second.
        tolerance_s: f64,
        /// First and last time of the estimate.
        estimate_s: [f64; 2],
        /// First and last time of the truth.
        truth_s: [f64; 2],
    },
    /// Two parts of a registration do not work together.
    #[error("{what} does not work with {with}")]
    Incompatible {
        /// The part.
        what: &'static str,
        /// What it was combined with.
        with: &'static str,
    },
    /// A triangle names a vertex that is not there.
    #[error("a triangle names vertex {vertex}, but there are {count} (from 0)")]
    NoSuchVertex {
        /// The index.
        vertex: usize,
        /// Number of vertices.
        count: usize,
    },
    /// A part of a registration names a point that is not there.
    #[error("{part} names point {point}, but there are {count} (from 0)")]
    NoSuchPoint {
        /// The part.
        part: &'static str,
        /// The index.
        point: usize,
        /// Number of points.
        count: usize,
    },
    /// A ray of a camera leads backwards, or coincides with or crosses its neighbour.
    #[error("ray {index}: {why}")]
    DegenerateRay {
        /// Index of the pixel, row by row.
        index: usize,
        /// What is wrong.
        why: &'static str,
    },
    /// Most points of a frame do not lie on the rays of their pixels.
    #[error("most points lie beside the rays of their pixels, among them point {index}: another camera or frame?")]
    PointsOffRays {
        /// Index of such a point, row by row.
        index: usize,
    },
    /// No alignment that holds leads to some stations.
    #[error("nothing connects stations {stations:?} to station {to} ({})", .reasons.join("; "))]
    UnconnectedStations {
        /// The stations that are left alone.
        stations: Vec<usize>,
        /// A station of the part that holds together.
        to: usize,
        /// Why, one for each of these stations.
        reasons: Vec<String>,
    },
    /// No pose of two clouds passed the verification.
    #[error(
        "no alignment found: {what} {found:.3}, at least {needed:.3} is needed ({correspondences} correspondences)"
    )]
    NoAlignment {
        /// What the best pose lacks.
        what: &'static str,
        /// What it has.
        found: f64,
        /// What it would need.
        needed: f64,
        /// Correspondences between the clouds.
        correspondences: usize,
    },
}

/// Result of this crate.
pub type Result<T> = std::result::Result<T, Error>;
