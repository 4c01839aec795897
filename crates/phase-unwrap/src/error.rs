use thiserror::Error;

/// What can be wrong with the input of an unwrapping.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Error {
    /// A raster has no pixel.
    #[error("the phase image has no pixel ({width} x {height})")]
    Empty {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// More pixels than 32-bit labels can number.
    #[error("{pixels} pixels are more than labels of 32 bit can number")]
    TooLarge {
        /// Number of pixels.
        pixels: usize,
    },
    /// Mask and NaN leave no pixel.
    #[error("none of {pixels} pixels can be used: all are masked out or not finite")]
    AllMasked {
        /// Number of pixels of the raster.
        pixels: usize,
    },
    /// Links are to be weighted by noise that nothing tells.
    #[error("edge weights by noise need a plane of standard deviations or of amplitudes; neither is given")]
    NoiseUnknown,
    /// A sequence has no frame.
    #[error("a sequence of no frames was given")]
    NoFrames,
    /// An option lies outside its domain.
    #[error("{name} = {value}: {expected}")]
    OutOfDomain {
        /// Name of the option.
        name: &'static str,
        /// Value given.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// A seed lies outside the image or on a pixel that is not used.
    #[error("the known wrap count {wraps} at column {col}, row {row} {why}")]
    UnusableSeed {
        /// Column.
        col: usize,
        /// Row.
        row: usize,
        /// Count given.
        wraps: i32,
        /// Why it cannot be used.
        why: &'static str,
    },
    /// The number of planes does not fit the number of frequencies.
    #[error("{what}: {found} planes for {expected} frequencies")]
    PlaneCount {
        /// Which planes.
        what: &'static str,
        /// Number of frequencies.
        expected: usize,
        /// Number of planes given.
        found: usize,
    },
    /// Multi-frequency unwrapping needs two frequencies.
    #[error("{found} modulation frequency given: at least two are needed to resolve the ambiguity")]
    TooFewFrequencies {
        /// Number of frequencies given.
        found: usize,
    },
    /// More frequencies than are searched together.
    #[error("{found} modulation frequencies given: at most {limit} are searched together")]
    TooManyFrequencies {
        /// Number of frequencies given.
        found: usize,
        /// Largest number.
        limit: usize,
    },
    /// Two frequencies have the same ambiguity interval.
    #[error("frequencies {first} and {second} have the same ambiguity interval of {interval_m} m")]
    EqualFrequencies {
        /// Position of the first.
        first: usize,
        /// Position of the second.
        second: usize,
        /// Their interval in metres.
        interval_m: f64,
    },
    /// More hypotheses a pixel than can be searched.
    #[error("{hypotheses} hypotheses a pixel (up to {maximum_range_m} m) exceed the limit of {limit}")]
    SearchTooLarge {
        /// Number of hypotheses a pixel.
        hypotheses: f64,
        /// Largest range searched in metres.
        maximum_range_m: f64,
        /// Limit.
        limit: usize,
    },
    /// The requested range exceeds what the frequencies can tell apart.
    #[error("maximum range {maximum_range_m} m exceeds the combined ambiguity interval of {combined_interval_m} m")]
    BeyondCombinedInterval {
        /// Range asked for in metres.
        maximum_range_m: f64,
        /// Combined ambiguity interval in metres.
        combined_interval_m: f64,
    },
    /// More residues than the options allow for the cheapest cuts.
    #[error("{residues} residues exceed the limit of {limit} for the cheapest cuts: filter first, or raise the limit")]
    TooManyResidues {
        /// Residues found.
        residues: usize,
        /// Limit of the options.
        limit: usize,
    },
    /// The cost of the cuts differs from the bound that proves the optimum.
    #[error("cuts of cost {cost} are not proven optimal: the bound is {lower_bound}")]
    NotOptimal {
        /// Cost found.
        cost: u64,
        /// Bound of the dual problem.
        lower_bound: u64,
    },
    /// A standard deviation is negative.
    #[error("sigma = {value} rad at column {col}, row {row}: a standard deviation is not negative")]
    NegativeSigma {
        /// Column.
        col: usize,
        /// Row.
        row: usize,
        /// Value found.
        value: f32,
    },
    /// Rasters that belong together differ, or another fault of a raster.
    #[error(transparent)]
    Raster(#[from] range_image::Error),
}

/// Result with this crate's [`enum@Error`].
pub(crate) type Result<T> = std::result::Result<T, Error>;
