//! The stages, one file each, and what they share.

mod adjust;
mod average;
mod cloud;
mod correct;
mod deconvolve;
mod demodulate;
mod flag;
mod fuse;
mod multipath;
mod reference_path;
mod register;
pub(crate) mod repair;
mod unwrap;

use std::collections::BTreeMap;

use range_io::calibration::Calibration;

use crate::progress::Progress;
use crate::work::Work;
use crate::{Result, Stage};

/// Figures that a stage reports, with units in their names.
pub(crate) type Findings = BTreeMap<String, f64>;

/// Whether a calibration has anything that [`Stage::CorrectRange`] takes off.
pub(crate) fn corrects_ranges(calibration: &Calibration) -> bool {
    !calibration.range_models.is_empty() || calibration.warm_up.is_some()
}

/// Runs one stage on all views.
pub(crate) fn apply(stage: &Stage, work: &mut Work, progress: &dyn Progress) -> Result<Findings> {
    match stage {
        Stage::Demodulate(options) => demodulate::run(work, options, progress),
        Stage::Average(options) => average::run(work, options, progress),
        Stage::Deconvolve(options) => deconvolve::run(work, options, progress),
        Stage::Unwrap(options) => unwrap::run(work, options, progress),
        Stage::RepairWraps(options) => repair::run(work, options, progress),
        Stage::CorrectRange(options) => correct::run(work, options, progress),
        Stage::CorrectImagePoint(_) => cloud::correct_image_point(work),
        Stage::Multipath(options) => multipath::run(work, options, progress),
        Stage::FuseExposures(options) => fuse::run(work, options, progress),
        Stage::PointCloud(_) => cloud::run(work, progress),
        Stage::Flag(options) => flag::run(work, options, progress),
        Stage::Register(options) => register::run(work, options, progress),
        Stage::Adjust(options) => adjust::run(work, options, progress),
    }
}
