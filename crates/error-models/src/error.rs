use thiserror::Error;

/// What can be wrong with a range-error model or with a frame given to it.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Error {
    /// A parameter of the model lies outside its domain.
    #[error("{name} = {value}: {expected}")]
    OutOfDomain {
        /// Name of the parameter.
        name: &'static str,
        /// Value given.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// A list of parameters names one that no range-error model has.
    #[error("'{name}' is no range-error parameter; known are {known}")]
    UnknownParameter {
        /// Name given.
        name: String,
        /// The canonical names.
        known: String,
    },
    /// A list of parameters names one twice.
    #[error("parameter {name} is given twice")]
    DuplicateParameter {
        /// The parameter.
        name: String,
    },
    /// A parameter comes in a unit other than its own.
    #[error("parameter {name} is given in '{found}', expected '{expected}'")]
    WrongUnit {
        /// The parameter.
        name: String,
        /// Unit given.
        found: String,
        /// Unit of the parameter.
        expected: &'static str,
    },
    /// A number of knots or an order is not one that a model can have.
    #[error("{name} = {count}: expected {least} to {most}")]
    OutOfBounds {
        /// Name of the number.
        name: &'static str,
        /// Number given.
        count: usize,
        /// Least that is possible.
        least: usize,
        /// Most that is possible.
        most: usize,
    },
    /// A list of numbers does not have one for each parameter of the model.
    #[error("{found} {name} for a model with {expected} parameters")]
    WrongLength {
        /// What the numbers are.
        name: &'static str,
        /// How many there are.
        found: usize,
        /// How many there should be.
        expected: usize,
    },
    /// Coefficients of the amplitude hyperbola were given without the amplitudes they were fitted in.
    #[error("h1, h2, h3 are given without the amplitude span they were fitted in")]
    MissingAmplitudeSpan,
    /// Two ranges would be observed as one: the range terms are no invertible map.
    #[error(
        "the range-dependent terms change by {slope} m per metre at a range of {range_m} m; below 1 they can be inverted"
    )]
    NotMonotone {
        /// Largest derivative of the correction with respect to the range.
        slope: f64,
        /// Range where it occurs, metre.
        range_m: f64,
    },
    /// The observed range that belongs to a true range was not found.
    #[error("no observed range found for a true range of {true_range_m} m: {misclosure_m} m are left over")]
    NotConverged {
        /// True range asked for, metre.
        true_range_m: f64,
        /// What the last iterate misses, metre.
        misclosure_m: f64,
    },
    /// No model was made for this integration time.
    #[error(
        "no range-error model for an integration time of {integration_time_s} s; there are models for {available_s:?} s"
    )]
    NoModelForIntegrationTime {
        /// Integration time asked for, second.
        integration_time_s: f64,
        /// Integration times there are, second.
        available_s: Vec<f64>,
    },
    /// The models of two integration times are of different kinds, so that there is nothing between them.
    #[error(
        "no range-error model between {shorter_s} s and {longer_s} s: only one of the two has a {term}; \
         calibrate both times with the same terms"
    )]
    DifferentKinds {
        /// Shorter integration time, second.
        shorter_s: f64,
        /// Longer integration time, second.
        longer_s: f64,
        /// What only one of them has.
        term: &'static str,
    },
    /// The models of two integration times have no range or amplitude in common.
    #[error("the models of {shorter_s} s and {longer_s} s have no {span} in common")]
    NoCommonSpan {
        /// Shorter integration time, second.
        shorter_s: f64,
        /// Longer integration time, second.
        longer_s: f64,
        /// Ranges or amplitudes.
        span: &'static str,
    },
    /// The drift is not known at this time or temperature.
    #[error("the drift is not known at a {name} of {value} {unit}: it was fitted from {} to {} {unit}", .span[0], .span[1])]
    OutsideDriftSpan {
        /// Time since power-on, or temperature.
        name: &'static str,
        /// Unit of the numbers.
        unit: &'static str,
        /// Value asked for.
        value: f64,
        /// Smallest and largest value of the fit.
        span: [f64; 2],
    },
    /// The drift depends on something that is not known of the frame.
    #[error("the drift depends on the {name}, which is not known of the frame")]
    MissingForDrift {
        /// What is missing.
        name: &'static str,
    },
    /// The drift follows the frame rate, which is not known of a stretch of time that still matters.
    #[error("the drift depends on the frame rate, which is not known from {from_s:.1} s to {to_s:.1} s after power-on")]
    UnknownFrameRate {
        /// Begin of the stretch, second since power-on.
        from_s: f64,
        /// Its end.
        to_s: f64,
    },
    /// Too few frames to tell their rate.
    #[error("{frames} frames tell no frame rate, {needed} are needed")]
    NoFrameStream {
        /// How many there are.
        frames: usize,
        /// How many are needed.
        needed: usize,
    },
    /// A frame error.
    #[error(transparent)]
    Image(#[from] range_image::Error),
}

/// Result with this crate's [`enum@Error`].
pub(crate) type Result<T> = std::result::Result<T, Error>;

/// Refuses a value that is not finite.
pub(crate) fn require_finite(name: &'static str, value: f64) -> Result<()> {
    if value.is_finite() {
        return Ok(());
    }
    Err(Error::OutOfDomain { name, value, expected: "a coefficient is finite" })
}

/// Refuses a span whose bounds are not finite or not ascending.
pub(crate) fn require_span(name: &'static str, [low, high]: [f64; 2]) -> Result<()> {
    require_finite(name, low)?;
    require_finite(name, high)?;
    if low < high {
        return Ok(());
    }
    Err(Error::OutOfDomain { name, value: high, expected: "the upper bound of a span lies above the lower one" })
}

/// Refuses a number of knots or an order outside its bounds.
pub(crate) fn require_count(name: &'static str, count: usize, [least, most]: [usize; 2]) -> Result<()> {
    if (least..=most).contains(&count) { Ok(()) } else { Err(Error::OutOfBounds { name, count, least, most }) }
}
