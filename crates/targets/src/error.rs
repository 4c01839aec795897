/// Why targets could not be looked for.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A description of a target, or an option, cannot be used.
    #[error("{name} = {value}: {expected}")]
    Invalid {
        /// Which number.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// The image was looked at, and the target is not in it.
    #[error(transparent)]
    NotFound(#[from] NotFound),
    /// A raster does not fit.
    #[error(transparent)]
    Raster(#[from] range_image::Error),
    /// The camera's parameters are not valid.
    #[error(transparent)]
    Camera(#[from] camera_model::Error),
}

/// Why a target was not found, in words that help to take a better image.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NotFound {
    /// The image has no contrast above its noise.
    #[error("the image has no contrast: its values spread by {contrast:.3e} at a noise of {noise:.3e}")]
    NoContrast {
        /// Spread of the values (10 to 90 %), in their unit.
        contrast: f64,
        /// Noise, same unit.
        noise: f64,
    },
    /// Too much of the image is saturated.
    #[error("{:.0} % of the image are saturated, and no target is seen in the rest: take it with less light", 100.0 * .share)]
    Saturated {
        /// Share of the pixels.
        share: f64,
    },
    /// Too few points of the right kind.
    #[error("{found} points look like parts of the target, {needed} are needed")]
    TooFewPoints {
        /// Points found.
        found: usize,
        /// Points needed.
        needed: usize,
    },
    /// Points were found, and they make no grid.
    #[error("{points} points were found; the largest grid among them holds {largest}, {needed} are needed")]
    NoGrid {
        /// Points found.
        points: usize,
        /// Nodes of the largest grid.
        largest: usize,
        /// Nodes needed.
        needed: usize,
    },
    /// A grid was found, of another size than the board.
    #[error("a grid of {} x {} nodes was found, the board has {} x {}", .found[0], .found[1], .board[0], .board[1])]
    WrongSize {
        /// Columns and rows found.
        found: [usize; 2],
        /// Columns and rows of the board.
        board: [usize; 2],
    },
    /// A part of the board was found that can lie in more than one place of it.
    #[error(
        "a part of {} x {} nodes was found, which fits the board of {} x {} in {places} places",
        .found[0], .found[1], .board[0], .board[1]
    )]
    PartAmbiguous {
        /// Columns and rows found.
        found: [usize; 2],
        /// Columns and rows of the board.
        board: [usize; 2],
        /// In how many places it fits.
        places: usize,
    },
    /// A grid of the size of the board was found, and its larger dot is not where the board has it.
    #[error(
        "a grid of {} x {} dots was found with {larger} larger dots, not the one at node (0, 0) that the board has: it is another \
         board, or the dot is covered or too little larger", .found[0], .found[1]
    )]
    WrongMark {
        /// Columns and rows found.
        found: [usize; 2],
        /// Dots that are larger than those about them.
        larger: usize,
    },
    /// The grid, or most of the coded rings, are seen in a mirror, or from behind.
    #[error("the target is mirrored: the image was flipped, or the target is seen in a mirror or from behind")]
    Mirrored,
    /// Several boards of this kind are in the image, and nothing tells them apart.
    #[error("{found} boards of this kind are in the image: cover all but one, or use coded targets")]
    SeveralBoards {
        /// How many.
        found: usize,
    },
    /// No surface around the target has a range.
    #[error("{pixels} pixels around the target have a range on one plane, {needed} in more than one row are needed")]
    NoRange {
        /// Pixels with a range.
        pixels: usize,
        /// Pixels needed.
        needed: usize,
    },
}

/// Share of saturated pixels beyond which they are why nothing was found: a lamp or a window takes less.
const MUCH_SATURATED: f64 = 0.2;

impl NotFound {
    /// This, or saturation where nothing is found in an image that is full of it.
    pub(crate) fn with_saturation(self, share: f64) -> Self {
        match self {
            Self::TooFewPoints { .. } | Self::NoGrid { .. } if share > MUCH_SATURATED => Self::Saturated { share },
            other => other,
        }
    }

    /// Of two reasons the one that says more of the target: that of the larger grid, if there is one.
    pub(crate) fn clearer(self, other: Self) -> Self {
        if other.nodes_of_grid() > self.nodes_of_grid() { other } else { self }
    }

    fn nodes_of_grid(&self) -> usize {
        match self {
            Self::WrongSize { found, .. } | Self::PartAmbiguous { found, .. } => found[0] * found[1],
            _ => 0,
        }
    }
}

/// Result with this crate's [`enum@Error`].
pub(crate) type Result<T> = std::result::Result<T, Error>;
