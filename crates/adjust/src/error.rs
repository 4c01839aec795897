use thiserror::Error;

use crate::Combination;

/// Why an adjustment could not be set up or gave no trustworthy result.
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
    /// There is nothing to adjust.
    #[error("the adjustment has no observations")]
    NoObservations,
    /// More unknowns than dense normal equations can hold.
    #[error("{unknowns} unknowns: dense normal equations are limited to {limit}")]
    TooLarge {
        /// Number of unknowns.
        unknowns: usize,
        /// Largest number.
        limit: usize,
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
    /// A residual or a derivative is NaN or infinite.
    #[error("group `{group}`, observation {observation}, component {component}: {what} is {value}")]
    NotFinite {
        /// Group of the observation.
        group: String,
        /// Number of the observation, in the order of adding.
        observation: usize,
        /// Component of the observation.
        component: usize,
        /// Residual or derivative.
        what: &'static str,
        /// The value.
        value: f64,
    },
    /// Observations, priors, constraints and datum together do not determine all unknowns.
    #[error("rank defect {defect}: not determined is {}", Combination::list(.combinations))]
    RankDeficient {
        /// Number of directions in the space of the unknowns that nothing determines.
        defect: usize,
        /// Those directions: one combination of parameters each.
        combinations: Vec<Combination>,
    },
    /// The points chosen for the datum cannot carry it.
    #[error("datum: {reason}")]
    Datum {
        /// What is wrong.
        reason: String,
    },
    /// The inner constraints remove more than the defect: the observations already determine part of the datum.
    #[error(
        "the inner constraints hold {held} directions, but the observations determine {determined} of them \
         (largest share {share:.3e}): the datum would bend the network"
    )]
    DatumOverdetermined {
        /// Directions held by the inner constraints.
        held: usize,
        /// How many of them the observations, priors or held parameters already determine.
        determined: usize,
        /// Largest share of a direction that is already determined, 0 to 1.
        share: f64,
    },
    /// Constraints that repeat or contradict each other, or touch only held parameters.
    #[error("constraint {index} depends on the other constraints and the datum, or touches no free parameter")]
    DependentConstraint {
        /// Number of the constraint, in the order of adding; inner constraints come last.
        index: usize,
    },
    /// The iteration did not reach its end.
    #[error(
        "not converged after {iterations} iterations ({reason}): last objective {objective:.9e}, last undamped step {step:.3e} \
         standard deviations, damping {damping:.1e}{}", settling(.parameter)
    )]
    NotConverged {
        /// Iterations done.
        iterations: usize,
        /// What ended the iteration.
        reason: &'static str,
        /// Last objective (v'Pv where no kernel is robust).
        objective: f64,
        /// Length of the last step in standard deviations (norm of `A·dx`, whitened).
        step: f64,
        /// Last damping factor.
        damping: f64,
        /// The parameter that would still move most, in units of how well it were known if all others were; empty where
        /// that is not known.
        parameter: String,
    },
    /// The adjustment found no end, or something undetermined, and the Jacobian of an observation differs from the
    /// differences of its model, at the approximate values and beside them: [`crate::check_jacobian`] finds such.
    #[error(
        "{consequence}; but the Jacobian of group `{group}`, observation {observation}, component {component} is wrong: its \
         derivative with respect to `{parameter}` is {given:.6e}, that by differences is {differences:.6e} (compare with \
         `check_jacobian`)"
    )]
    Jacobian {
        /// Group of the observation, or `constraint`.
        group: String,
        /// Number of the observation or constraint, in the order of adding.
        observation: usize,
        /// Component of the observation.
        component: usize,
        /// The parameter whose derivative is furthest off.
        parameter: String,
        /// The derivative of the model that the observation gave.
        given: f64,
        /// The derivative of the model by differences.
        differences: f64,
        /// The error that came of it: [`Error::NotConverged`] or [`Error::RankDeficient`].
        #[source]
        consequence: Box<Error>,
    },
    /// A posterior scale was asked for where there is no redundancy.
    #[error("redundancy {redundancy}: there is no posterior variance factor")]
    NoRedundancy {
        /// Redundancy of the adjustment.
        redundancy: i64,
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
    /// A matrix decomposition failed to converge.
    #[error("the {what} did not converge")]
    Decomposition {
        /// Which decomposition.
        what: &'static str,
    },
}

/// What does not settle, in words.
fn settling(parameter: &str) -> String {
    if parameter.is_empty() { String::new() } else { format!("; `{parameter}` does not settle") }
}

/// Result with this crate's [`enum@Error`].
pub(crate) type Result<T> = std::result::Result<T, Error>;

/// What is wrong with an observation equation is wrong with the adjustment.
impl From<observation_equations::Error> for Error {
    fn from(error: observation_equations::Error) -> Self {
        use observation_equations::Error as Equation;
        match error {
            Equation::UnknownId { what, index, count } => Self::UnknownId { what, index, count },
            Equation::Length { what, expected, found } => Self::Length { what, expected, found },
            Equation::InvalidBlock { block, values, reason } => Self::InvalidBlock { block, values, reason },
            Equation::Covariance { group, matrix } => Self::Covariance { group, matrix },
            Equation::Evaluation { group, observation, reason } => Self::Evaluation { group, observation, reason },
            Equation::Option { name, value, expected } => Self::Option { name, value, expected },
            Equation::Untestable { what, reason } => Self::Untestable { what, reason },
            other => Self::Untestable { what: other.to_string(), reason: "it is no observation equation" },
        }
    }
}

impl From<dense_matrices::Error> for Error {
    fn from(error: dense_matrices::Error) -> Self {
        match error {
            dense_matrices::Error::Decomposition { what } => Self::Decomposition { what },
            _ => Self::Decomposition { what: "decomposition" },
        }
    }
}
