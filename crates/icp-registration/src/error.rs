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
    /// Two parts of a registration do not work together.
    #[error("{what} does not work with {with}")]
    Incompatible {
        /// The part.
        what: &'static str,
        /// What it was combined with.
        with: &'static str,
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
    /// A triangle names a vertex that is not there.
    #[error("a triangle names vertex {vertex}, but there are {count} (from 0)")]
    NoSuchVertex {
        /// The index.
        vertex: usize,
        /// Number of vertices.
        count: usize,
    },
    /// A coordinate, weight or sigma is NaN, infinite or beyond ±1e100.
    #[error("{what}: entry {index} is not a finite number below 1e100")]
    NonFinite {
        /// Which input.
        what: &'static str,
        /// Its index, counted from 0.
        index: usize,
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
    /// A linear system or an eigenvalue problem could not be solved.
    #[error("{what} could not be solved: {why}")]
    Numerical {
        /// Which system.
        what: &'static str,
        /// The reason.
        why: &'static str,
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
    /// Voxels of this size cannot be numbered in this cloud.
    #[error("voxels of {voxel_m} m in a cloud of {extent_m} m: the size must be positive, and above 1/2 000 000 of it")]
    VoxelSize {
        /// Edge of a voxel, metre.
        voxel_m: f64,
        /// Largest extent of the cloud along an axis, metre.
        extent_m: f64,
    },
}

impl Error {
    /// Whether the input or an option is wrong; otherwise the data do not show what was asked for.
    #[must_use]
    pub fn is_misuse(&self) -> bool {
        match self {
            Self::Cloud(error) => error.is_misuse(),
            Self::Pose(error) => error.is_misuse(),
            _ => matches!(
                self,
                Self::NonFinite { .. }
                    | Self::NotPositive { .. }
                    | Self::LengthMismatch { .. }
                    | Self::InvalidOption { .. }
                    | Self::VoxelSize { .. }
                    | Self::Incompatible { .. }
                    | Self::NoSuchVertex { .. }
                    | Self::NoSuchPoint { .. }
            ),
        }
    }
}

/// Result of this crate.
pub(crate) type Result<T> = std::result::Result<T, Error>;
