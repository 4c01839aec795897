//! What a way to calibrate comes to.

use self_calibration::{CalibrationOutcome, Error, HoldOut};

use crate::calibrate::planes::offset::FoundTable;
use crate::calibrate::start::Start;

/// What the adjustment gave.
pub(crate) struct Calibrated {
    pub(crate) outcome: CalibrationOutcome,
    /// A table of offsets, where one was asked for.
    pub(crate) table: Option<FoundTable>,
    /// The check on stations left out, where it was asked for.
    pub(crate) check: Option<Result<HoldOut, Error>>,
}

/// Start values and what the adjustment said of them.
pub(crate) type Attempt = (Start, Result<Calibrated, Error>);
