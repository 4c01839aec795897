use thiserror::Error;

/// Why noise or pattern of a sensor were not estimated.
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
    /// A station has too few frames of its scene.
    #[error("station `{station}` has {frames} frames, {needed} are needed")]
    TooFewFrames {
        /// Name of the station.
        station: String,
        /// Frames there are.
        frames: usize,
        /// Frames needed.
        needed: usize,
    },
    /// Repeated frames of one station are not alike in size, phase steps or frequencies.
    #[error("station `{station}`: frame {frame} has another size, number of phase steps or frequency than frame 0")]
    FramesDiffer {
        /// Name of the station.
        station: String,
        /// The frame, counted from 0.
        frame: usize,
    },
    /// Too few values were repeated.
    #[error("{values} usable values with repeats, {needed} are needed: too little light, or all saturated")]
    TooFewRepeats {
        /// Values there are.
        values: usize,
        /// Values needed.
        needed: usize,
    },
    /// The values wander from frame to frame.
    #[error(
        "station `{station}` drifts: successive differences have {:.0} % of the variance about the mean, and would still \
         hold {:.1} % of drift; let the camera warm up", 100.0 * .ratio, 100.0 * .share
    )]
    FramesDrift {
        /// Name of the station.
        station: String,
        /// Variance from successive differences over that about the mean.
        ratio: f64,
        /// Share of the drift in the variance of successive differences.
        share: f64,
    },
    /// One frame is unlike the others of its station.
    #[error(
        "station `{station}`: frame {frame} scatters {factor:.2} times as much as the others; light or scene changed"
    )]
    FrameStandsOut {
        /// Name of the station.
        station: String,
        /// The frame, counted from 0.
        frame: usize,
        /// Its variance over that of the others.
        factor: f64,
    },
    /// Too many values scatter as no noise does.
    #[error("{:.0} % of the values scatter more than noise does, {:.0} % are allowed: the scene moved", 100.0 * .share, 100.0 * .limit)]
    SceneMoved {
        /// Share of such values.
        share: f64,
        /// Largest share allowed.
        limit: f64,
    },
    /// The observed variances follow no straight line.
    #[error(
        "the variances are {:.0} % off the noise model, {:.0} % are allowed: this is not the noise it describes",
        100.0 * .misfit, 100.0 * .limit
    )]
    NoiseDoesNotFit {
        /// Root mean square of the relative differences.
        misfit: f64,
        /// Largest that is allowed.
        limit: f64,
    },
    /// A part of the noise came out negative by more than chance.
    #[error(
        "the {part} has a variance of {value:e} with a deviation of {sigma:e}: this is not the noise the model describes"
    )]
    NegativeVariance {
        /// Which part.
        part: &'static str,
        /// Its estimate.
        value: f64,
        /// Its standard deviation.
        sigma: f64,
    },
    /// Light or amplitude varies too little over the frames.
    #[error(
        "{} and {} cannot be told apart: the light varies too little (regressor {:e} to {:e}, of its variance {:.0} % is noise; \
         one deviation of the first is {:.0} % of the whole); show dark and bright surfaces", .parts[0], .parts[1],
        .span[0], .span[1], 100.0 * .flattening, 100.0 * .open
    )]
    NoisePartsNotApart {
        /// The two parts.
        parts: [&'static str; 2],
        /// Smallest and largest light (for ranges: one over the squared amplitude).
        span: [f64; 2],
        /// Share of noise in the variance of the light.
        flattening: f64,
        /// Share of the whole variance that one deviation of the first part is.
        open: f64,
    },
    /// Noise of ranges was asked for without amplitudes.
    #[error("station `{station}` has no amplitudes, which the noise of ranges depends on")]
    NoAmplitudes {
        /// Name of the station.
        station: String,
    },
    /// No plane could be fitted to a wall.
    #[error(transparent)]
    Primitive(#[from] primitives::Error),
    /// The adjustment of a line failed.
    #[error(transparent)]
    Adjust(#[from] adjust::Error),
    /// The estimated model is not usable.
    #[error(transparent)]
    Model(#[from] error_models::Error),
    /// The frame is not valid.
    #[error(transparent)]
    Image(#[from] range_image::Error),
}

/// Result with this crate's [`enum@Error`], or that of a source of frames.
pub(crate) type Result<T, E = Error> = std::result::Result<T, E>;
