//! A survey's frames as views, what is known of them, and what speaks against them.

pub(crate) mod compatible;
pub(crate) mod correction_record;
pub(crate) mod drift;
pub mod frame_rates;
pub(crate) mod open;
pub mod plausibility;
pub(crate) mod records;
pub(crate) mod span;
pub(crate) mod truth;
pub(crate) mod view;

pub use compatible::{Purpose, UNKNOWN_INTEGRATION_TIME_S, compatible, model_set};
pub use correction_record::{CorrectionRecord, PixelLedger};
pub use drift::{DriftCurve, DriftSource, FrameRatePart, ViewDrift};
pub use open::{OpenSurvey, StatedPoses, open, read_calibration};
pub use plausibility::{FrameWatch, SenseVotes, StoredWatch};
pub use records::{AdjustmentFigures, RefusedStage, StageSummary, StationPose, ViewRecord};
pub use truth::{RangeTruth, ViewTruth, wrap};
pub use view::{FurtherPoint, LiveFrames, Snapshot, View, ViewData, view_name};
