use thiserror::Error;

/// Why frames do not determine the drift of a camera.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum DriftError {
    /// An option outside its domain.
    #[error("option {name} = {value}: {expected}")]
    OutOfDomain {
        /// Its name.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
    /// A sample that is no number, or without a standard deviation.
    #[error("sample {index}: {name} is {value}, expected {expected}")]
    BadSample {
        /// Its place, from 0.
        index: usize,
        /// What is wrong.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
    /// Times that do not ascend.
    #[error("timestamps do not ascend: sample {index} is of {time_s} s, the one before of {before_s} s")]
    NotAscending {
        /// Place of the second of the two, from 0.
        index: usize,
        /// Its time.
        time_s: f64,
        /// The time before.
        before_s: f64,
    },
    /// Too few values.
    #[error("{blocks} blocks with frames, {needed} are needed: capture longer, or more frames")]
    TooFewBlocks {
        /// Blocks with samples.
        blocks: usize,
        /// How many are needed.
        needed: usize,
    },
    /// A capture that no drift would show in.
    #[error(
        "the capture lasts {duration_s:.0} s: too short for a drift of tens of minutes; {needed_s:.0} s are needed"
    )]
    CaptureTooShort {
        /// From the first to the last frame.
        duration_s: f64,
        /// Shortest that is taken.
        needed_s: f64,
    },
    /// A drift that goes on at the end.
    #[error(
        "the capture lasts {:.1} min, but the drift goes on at its end: it suggests a time constant of {:.1} min or \
         more, which takes {:.1} min to be told", duration_s / 60.0, time_constant_s / 60.0, needed_s / 60.0
    )]
    ShorterThanTimeConstant {
        /// From the first to the last frame.
        duration_s: f64,
        /// The longest time constant that the frames suggest.
        time_constant_s: f64,
        /// What it takes: three of them.
        needed_s: f64,
    },
    /// Frames are missing, and with them the work load of the camera.
    #[error(
        "nothing says at what rate the camera took frames from {from_s:.0} s to {to_s:.0} s, and the drift depends on it: \
         state the frame rates, or give the frames of one side alone"
    )]
    FrameRateUnknown {
        /// Begin of the stretch, second since power-on.
        from_s: f64,
        /// Its end.
        to_s: f64,
    },
    /// Rates that change too soon to see where they lead.
    #[error(
        "the drift follows the frame rate with a time constant of {:.1} min, and the longest phase behind a change of the \
         rate lasts {:.1} min: {:.1} min are needed to tell where it leads",
        time_constant_s / 60.0, phase_s / 60.0, needed_s / 60.0
    )]
    PhaseTooShort {
        /// The longest phase behind a change.
        phase_s: f64,
        /// The time constant that the frames suggest.
        time_constant_s: f64,
        /// What it takes: three of them.
        needed_s: f64,
    },
    /// A drift that follows the frame rate within a block.
    #[error(
        "the drift follows the frame rate with a time constant of {time_constant_s:.1} s, which means over {block_s:.1} s \
         cannot tell: average over more blocks"
    )]
    FasterThanBlock {
        /// The time constant that the frames suggest.
        time_constant_s: f64,
        /// Length of a block.
        block_s: f64,
    },
    /// The scene or the camera was moved.
    #[error(
        "the ranges jump by {:.2} mm (sigma {:.2} mm) at {time_s:.0} s: scene or camera was moved; give the frames of \
         one side alone", 1e3 * size_m, 1e3 * sigma_m
    )]
    Jump {
        /// Time of the jump.
        time_s: f64,
        /// Its size.
        size_m: f64,
        /// Standard deviation of the size.
        sigma_m: f64,
    },
    /// No temperature where the drift is to follow it.
    #[error("sample {index} has no temperature, and the drift is to follow it")]
    MissingTemperature {
        /// Its place, from 0.
        index: usize,
    },
    /// A temperature that tells nothing.
    #[error("the temperature varies by {spread_k:.2} K only, {needed_k} K are needed to tell what follows it")]
    TemperatureConstant {
        /// Largest less smallest mean of a block.
        spread_k: f64,
        /// What is needed.
        needed_k: f64,
    },
    /// Residuals that wander as no noise does.
    #[error(
        "exponentials do not explain the drift: blocks beside them correlate by {autocorrelation:.2}, limit {limit}"
    )]
    NotExplained {
        /// Correlation of neighbouring blocks.
        autocorrelation: f64,
        /// Largest that is taken.
        limit: f64,
    },
    /// A frame of another size.
    #[error("frame {index} has {} x {} pixels, the first has {} x {}", found[0], found[1], expected[0], expected[1])]
    SizeDiffers {
        /// Its place, from 0.
        index: usize,
        /// Columns and rows.
        found: [usize; 2],
        /// Those of the first frame.
        expected: [usize; 2],
    },
    /// Too few pixels with ranges throughout.
    #[error("{pixels} pixels have ranges throughout, {needed} are needed")]
    NoPixelsThroughout {
        /// How many there are.
        pixels: usize,
        /// How many are needed.
        needed: usize,
    },
    /// Nothing usable in a frame.
    #[error("frame {index}: none of the pixels used has a range")]
    EmptyFrame {
        /// Its place, from 0.
        index: usize,
    },
    /// A scene that is not at rest.
    #[error(
        "{:.1} % of the pixels wander from all others by more than their noise, limit {:.1} %: the scene moves",
        100.0 * share, 100.0 * limit
    )]
    SceneMoves {
        /// Share of the pixels.
        share: f64,
        /// Largest that is taken.
        limit: f64,
    },
    /// A frame whose planes do not fit each other.
    #[error("frame {index}: {source}")]
    Frame {
        /// Its place, from 0.
        index: usize,
        /// What is wrong.
        source: range_image::Error,
    },
    /// The fit has no answer.
    #[error(transparent)]
    Adjust(#[from] adjust::Error),
    /// A model that is none.
    #[error(transparent)]
    Model(#[from] error_models::Error),
}

impl DriftError {
    /// Whether a fit has no answer because its unknowns cannot be told apart.
    pub(crate) fn is_unresolved(&self) -> bool {
        use adjust::Error::{NotConverged, NotFinite, RankDeficient};
        matches!(self, Self::Adjust(RankDeficient { .. } | NotConverged { .. } | NotFinite { .. }))
    }
}

/// Result with [`DriftError`].
pub type DriftResult<T> = std::result::Result<T, DriftError>;
