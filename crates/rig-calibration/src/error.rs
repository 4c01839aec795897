use thiserror::Error;

/// Why a rig could not be calibrated.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Error {
    /// One camera makes no rig.
    #[error("a rig has at least two cameras, but there is {found}; calibrate one camera by itself")]
    TooFewCameras {
        /// How many there are.
        found: usize,
    },
    /// Two cameras have one name.
    #[error("two cameras are called `{0}`")]
    DuplicateCamera(String),
    /// Something about the network of one camera.
    #[error("camera `{camera}`: {source}")]
    Camera {
        /// Name of the camera.
        camera: String,
        /// What is wrong.
        source: Box<self_calibration::Error>,
    },
    /// What a camera's network has, but a rig has not.
    #[error("camera `{camera}`: {reason}")]
    Unfit {
        /// Name of the camera.
        camera: String,
        /// What it has.
        reason: String,
    },
    /// The datum asked for and the control contradict each other.
    #[error("datum: {0}")]
    Datum(String),
    /// Cameras that were never exposed together.
    #[error(
        "{first} and {second} share no epoch: nothing tells how they sit on the rig; stations of one name in two cameras \
         are exposures of one moment ({names})"
    )]
    NeverTogether {
        /// Names of one group of cameras that are connected with each other.
        first: String,
        /// Names of the others.
        second: String,
        /// Epochs of either.
        names: String,
    },
    /// Cameras without enough targets in common.
    #[error(
        "camera `{camera}` has {found} targets in common with the other cameras (or with given coordinates), but three, not \
         in one line, are needed to bring it into their frame"
    )]
    NotConnected {
        /// Name of the camera.
        camera: String,
        /// Targets in common.
        found: usize,
    },
    /// The observations of a camera do not fit the targets of the others.
    #[error("camera `{camera}`: {reason}")]
    NotPlaced {
        /// Name of the camera.
        camera: String,
        /// What does not fit.
        reason: String,
    },
    /// Poses of the cameras that contradict one mounting for all epochs.
    #[error("the cameras of the rig contradict each other: {0}")]
    Contradiction(String),
    /// So much of a camera's observations was rejected that the result is worth nothing.
    #[error("camera `{camera}`: too many observations disagree with the result of the rig: {reason}")]
    Hopeless {
        /// Name of the camera.
        camera: String,
        /// Sentences about its stations.
        reason: String,
    },
    /// The adjustment of the rig.
    #[error(transparent)]
    Network(#[from] calibration_network::Error),
    /// The outcome of the adjustment.
    #[error(transparent)]
    Calibration(#[from] self_calibration::Error),
}

impl Error {
    /// Something about the network of one camera.
    pub(crate) fn of(camera: &str, source: impl Into<self_calibration::Error>) -> Self {
        Self::Camera { camera: camera.to_owned(), source: Box::new(source.into()) }
    }
}

impl From<adjust::Error> for Error {
    fn from(error: adjust::Error) -> Self {
        Self::Network(error.into())
    }
}

pub(crate) type Result<T, E = Error> = std::result::Result<T, E>;
