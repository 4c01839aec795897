/// What can be wrong with a frame, a response or the options.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// There is no pixel, or too few in one direction for what is asked.
    #[error("a frame of {width} x {height} pixels is too small: at least {least} in each direction are needed")]
    TooSmall {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Least number of columns and of rows.
        least: usize,
    },
    /// A parameter lies outside its domain.
    #[error("{name} = {value}: {expected}")]
    OutOfDomain {
        /// Name of the parameter.
        name: &'static str,
        /// Value given.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// One frequency cannot contradict itself, and fixed arrays end at some number.
    #[error("{found} modulation frequencies: between {least} and {most} are needed")]
    FrequencyCount {
        /// How many there are.
        found: usize,
        /// Fewest allowed.
        least: usize,
        /// Most allowed.
        most: usize,
    },
    /// Two frequencies of one value tell one thing twice.
    #[error("frequencies {first} and {second} are both {frequency_hz} Hz: only different ones tell paths apart")]
    RepeatedFrequency {
        /// Position of the first.
        first: usize,
        /// Position of the second.
        second: usize,
        /// Their value, hertz.
        frequency_hz: f64,
    },
    /// A list does not have one entry for each of what it belongs to.
    #[error("{what}: {found} given, {expected} needed")]
    Count {
        /// What was counted.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many there should be.
        expected: usize,
    },
    /// The frame was modulated otherwise than the detector or solver was made for.
    #[error("channel {channel} is modulated at {found_hz} Hz, expected {expected_hz} Hz")]
    OtherFrequency {
        /// Position of the channel.
        channel: usize,
        /// What was expected, hertz.
        expected_hz: f64,
        /// What the frame has, hertz.
        found_hz: f64,
    },
    /// Nothing says how good the values of a channel are, so that nothing can be weighed against them.
    #[error(
        "channel {channel} has values and no standard deviation: give sigma (`ComplexFrame::with_sigma`) or predict it \
         (`ComplexChannel::predict_sigma`)"
    )]
    SigmaUnknown {
        /// Position of the channel.
        channel: usize,
    },
    /// A robust estimate needs more pixels than can be used.
    #[error("{what}: {found} usable pixels, at least {least} are needed")]
    TooFewPixels {
        /// What was to be estimated.
        what: &'static str,
        /// Usable pixels.
        found: usize,
        /// Fewest allowed.
        least: usize,
    },
    /// A viewing direction is no unit vector.
    #[error("the viewing direction of pixel {index} has length {length}, expected 1")]
    NotUnit {
        /// Row-major position of the pixel.
        index: usize,
        /// Length found.
        length: f64,
    },
    /// A search grid would not end in useful time.
    #[error("a search over {grid_points} pairs of ranges, at most {limit}: shorten the span or the detour")]
    SearchTooLarge {
        /// Pairs of ranges there would be.
        grid_points: f64,
        /// Most allowed.
        limit: usize,
    },
    /// A frame error.
    #[error(transparent)]
    Image(#[from] range_image::Error),
}

/// Result with this crate's [`enum@Error`].
pub(crate) type Result<T> = std::result::Result<T, Error>;

/// Refuses what is not finite or negative.
pub(crate) fn require_not_negative(name: &'static str, value: f64) -> Result<()> {
    if value.is_finite() && value >= 0.0 {
        return Ok(());
    }
    Err(Error::OutOfDomain { name, value, expected: "finite and not negative" })
}

/// Refuses what is not finite and positive.
pub(crate) fn require_positive(name: &'static str, value: f64) -> Result<()> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(Error::OutOfDomain { name, value, expected: "finite and positive" })
}

/// Refuses what is no probability of a rare event.
pub(crate) fn require_probability(name: &'static str, value: f64) -> Result<()> {
    if value > 1e-15 && value < 0.5 {
        return Ok(());
    }
    Err(Error::OutOfDomain { name, value, expected: "a probability between 1e-15 and 0.5" })
}
