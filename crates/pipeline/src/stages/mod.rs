//! The stages, one file each, and what they share.

pub(crate) mod average;
pub(crate) mod cloud;
pub(crate) mod deconvolve;
pub(crate) mod demodulate;
pub(crate) mod flag;
pub(crate) mod fuse;
pub(crate) mod joining;
pub(crate) mod multipath;
pub(crate) mod ranges;
pub(crate) mod wraps;

use std::collections::BTreeMap;

use range_io::calibration::Calibration;

use crate::command::progress::Progress;
use crate::survey::work::Work;
use crate::{Result, Stage};

/// Figures that a stage reports, with units in their names.
pub type Findings = BTreeMap<String, f64>;

/// Whether a calibration has anything that [`Stage::CorrectRange`] takes off.
pub fn corrects_ranges(calibration: &Calibration) -> bool {
    !calibration.range_models.is_empty() || calibration.warm_up.is_some()
}

/// Runs one stage on all views.
pub fn apply(stage: &Stage, work: &mut Work, progress: &dyn Progress) -> Result<Findings> {
    match stage {
        Stage::Demodulate(options) => demodulate::run(work, options, progress),
        Stage::Average(options) => average::run(work, options, progress),
        Stage::Deconvolve(options) => deconvolve::run(work, options, progress),
        Stage::Unwrap(options) => wraps::unwrap::run(work, options, progress),
        Stage::RepairWraps(options) => wraps::repair::run(work, options, progress),
        Stage::CorrectRange(options) => ranges::correct::run(work, options, progress),
        Stage::CorrectImagePoint(_) => cloud::correct_image_point(work),
        Stage::Multipath(options) => multipath::run(work, options, progress),
        Stage::FuseExposures(options) => fuse::run(work, options, progress),
        Stage::PointCloud(_) => cloud::run(work, progress),
        Stage::Flag(options) => flag::run(work, options, progress),
        Stage::Register(options) => joining::register::run(work, options, progress),
        Stage::Adjust(options) => joining::adjust::run(work, options, progress),
    }
}
