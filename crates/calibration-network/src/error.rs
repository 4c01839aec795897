use thiserror::Error;

use crate::OutsideImage;

/// Why a network could not be adjusted.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Error {
    /// An argument or option lies outside its domain.
    #[error("{name} = {value}: {expected}")]
    OutOfDomain {
        /// Name of the argument.
        name: &'static str,
        /// Value given.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// Two stations or two targets have one name.
    #[error("two {kind}s are called `{name}`")]
    DuplicateName {
        /// Station or target.
        kind: &'static str,
        /// Name.
        name: String,
    },
    /// A number of the network that cannot be used.
    #[error("{what}: {name} = {value}, expected {expected}")]
    BadNetworkValue {
        /// Which sighting, station, target or distance, by name.
        what: String,
        /// Which of its numbers.
        name: &'static str,
        /// The number.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// Something names a station, target or term that does not exist.
    #[error("{what} names {kind} `{name}`, which does not exist; there are {known}")]
    UnknownName {
        /// What names it.
        what: String,
        /// Station, target or term.
        kind: &'static str,
        /// Name, or number in the list.
        name: String,
        /// What there is.
        known: String,
    },
    /// A station or target is observed too little to be determined.
    #[error("{kind} `{name}` has {found}, but needs {needed}")]
    TooFewSightings {
        /// Station or target.
        kind: &'static str,
        /// Name.
        name: String,
        /// What it has.
        found: String,
        /// What it needs.
        needed: &'static str,
    },
    /// No approximate pose or position was found.
    #[error("no start values for {kind} `{name}`: {reason}")]
    NotReachable {
        /// Station, target or camera.
        kind: &'static str,
        /// Name.
        name: String,
        /// Why.
        reason: String,
    },
    /// The datum asked for and the network contradict each other.
    #[error("datum: {reason}")]
    Datum {
        /// What contradicts, with names.
        reason: String,
    },
    /// The network cannot tell some calibration parameters apart, or from the stations.
    #[error(
        "the network does not determine {combination} (known {inflation:.0} times worse than each alone; {correlation}); \
         {advice}"
    )]
    WeakNetwork {
        /// The combination of parameters, with weights.
        combination: String,
        /// How many times larger its deviation is than if its parameters did not share their effect; infinite where
        /// nothing determines it.
        inflation: f64,
        /// With what it is correlated.
        correlation: String,
        /// What to add to the network.
        advice: String,
    },
    /// An image point that lies outside the image.
    #[error(transparent)]
    OutsideImage(#[from] Box<OutsideImage>),
    /// Finding start values failed.
    #[error(transparent)]
    Orientation(#[from] orientation::Error),
    /// The adjustment failed.
    #[error(transparent)]
    Adjust(#[from] adjust::Error),
    /// The camera is not valid.
    #[error(transparent)]
    Camera(#[from] camera_model::Error),
    /// The estimated model is not usable, or a parameter name is unknown.
    #[error(transparent)]
    Model(#[from] error_models::Error),
}

impl Error {
    /// Whether an adjustment failed as it does where observations contradict each other.
    pub fn is_without_end(&self) -> bool {
        use adjust::Error::{Decomposition, Evaluation, NotConverged, NotFinite};
        matches!(self, Self::Adjust(NotConverged { .. } | Evaluation { .. } | NotFinite { .. } | Decomposition { .. }))
    }
}

pub(crate) type Result<T> = std::result::Result<T, Error>;
