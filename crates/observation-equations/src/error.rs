use thiserror::Error;

/// Why an observation equation is not usable.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Error {
    /// An identifier does not belong to this adjustment.
    #[error("{what} number {index} does not exist: there are {count}")]
    UnknownId {
        /// Block, group, observation or parameter.
        what: &'static str,
        /// Number asked for.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// A list of values does not have the length that its use asks for.
    #[error("{what} has {found} values, {expected} are needed")]
    Length {
        /// What was given.
        what: String,
        /// Length needed.
        expected: usize,
        /// Length found.
        found: usize,
    },
    /// Values of a parameter block that its manifold does not hold, or that are not finite.
    #[error("parameter block `{block}`: the values {values:?} are not valid ({reason})")]
    InvalidBlock {
        /// Name of the block.
        block: String,
        /// Values given.
        values: Vec<f64>,
        /// What is wrong with them.
        reason: &'static str,
    },
    /// A covariance matrix that is not symmetric and positive definite.
    #[error("covariance of an observation in group `{group}` is not symmetric and positive definite: {matrix:?}")]
    Covariance {
        /// Group of the observation.
        group: String,
        /// The matrix, row by row.
        matrix: Vec<f64>,
    },
    /// The model of an observation could not be computed at the current parameters.
    #[error("group `{group}`, observation {observation}: {reason}")]
    Evaluation {
        /// Group of the observation.
        group: String,
        /// Number of the observation, in the order of adding.
        observation: usize,
        /// What the observation said.
        reason: String,
    },
    /// An option lies outside its domain.
    #[error("option {name} = {value}: {expected}")]
    Option {
        /// Name of the option.
        name: &'static str,
        /// Value given.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// A question about the solution that has no answer.
    #[error("{what}: {reason}")]
    Untestable {
        /// What was asked about.
        what: String,
        /// Why there is no answer.
        reason: &'static str,
    },
}

/// Result with this crate's [`enum@Error`].
pub(crate) type Result<T> = std::result::Result<T, Error>;

/// Why a model could not be evaluated at given parameters, said by an [`crate::Observation`]
/// (for example "the point lies behind the camera").
///
/// During the descent such a trial step is shortened; at the start values it ends the adjustment with
/// an error that names the observation.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{reason}")]
pub struct EvaluationFailure {
    reason: std::borrow::Cow<'static, str>,
}

impl EvaluationFailure {
    /// A failure with its reason.
    pub fn new(reason: impl Into<std::borrow::Cow<'static, str>>) -> Self {
        Self { reason: reason.into() }
    }
}
