//! A survey's frames as views, what is known of them, and what speaks against them.

pub(crate) mod compatible;
pub(crate) mod correction_record;
pub(crate) mod drift;
pub mod frame_rates;
pub(crate) mod load;
pub(crate) mod outcome;
pub mod plausibility;
pub(crate) mod span;
pub(crate) mod truth;
pub(crate) mod view;
pub(crate) mod work;

pub use compatible::{Purpose, UNKNOWN_INTEGRATION_TIME_S, compatible, model_set};
pub use correction_record::CorrectionRecord;
pub use drift::{DriftCurve, DriftSource, FrameRatePart, ViewDrift};
pub use load::{Frames, open, read_calibration};
pub use outcome::{AdjustmentFigures, FurtherPoint, Outcome, RefusedStage, StageSummary, StationPose};
pub use plausibility::{FrameWatch, SenseVotes};
pub use truth::{RangeTruth, ViewTruth};
pub use view::{Snapshot, View, ViewData, view_name};
pub use work::Work;
