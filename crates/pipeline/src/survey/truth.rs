//! Comparison with the truth of a simulated survey.

use nalgebra::Isometry3;
use range_image::{Flags, Modulation, Raster};
use serde::Serialize;
use statistics::quantile;

use crate::survey::view::View;

/// What is true of one view.
#[derive(Debug, Clone)]
pub struct ViewTruth {
    /// True range along the ray of each pixel's centre, metre; NaN where nothing is hit.
    pub range: Raster<f32>,
    /// True pose, where the survey states it.
    pub world_from_camera: Option<Isometry3<f64>>,
}

/// How far the ranges of one or of all views are from the truth, on the pixels that no flag excludes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RangeTruth {
    /// Median of the absolute range error, metre.
    pub range_error_median_m: f64,
    /// 95 % of the absolute range errors are below this, metre.
    pub range_error_p95_m: f64,
    /// Fraction of pixels whose number of whole ambiguity intervals is right; 1 where no modulation is known.
    pub wrap_count_right_fraction: f64,
    /// Fraction of the pixels with a true range that carry a flag.
    pub flagged_fraction: f64,
    /// Unflagged pixels compared.
    pub pixels: usize,
}

/// Signed errors of the unflagged pixels of a view, metre; NaN where there is nothing to compare.
///
/// While the range is still wrapped, the error is taken modulo the ambiguity interval, so that the figures of
/// all stages can be compared.
pub fn range_errors(view: &View) -> Option<Vec<f64>> {
    let truth = view.truth.as_ref()?;
    let snapshot = view.snapshot()?;
    let wrapped = view.wrapped_to();
    let error = |(range, truth): (&f32, &f32)| {
        let difference = f64::from(*range) - f64::from(*truth);
        wrapped.map_or(difference, |modulation| wrap(difference, modulation))
    };
    Some(snapshot.range.as_slice().iter().zip(truth.range.as_slice()).map(error).collect())
}

/// A difference of ranges brought into half an ambiguity interval around zero.
pub(crate) fn wrap(difference_m: f64, modulation: Modulation) -> f64 {
    let interval = modulation.ambiguity_interval_m();
    difference_m - (difference_m / interval).round() * interval
}

/// Figures of several views taken together; `None` where no view has truth and ranges.
pub fn evaluate(views: &[&View], modulation: Option<Modulation>) -> Option<RangeTruth> {
    let mut errors = Vec::new();
    let (mut known, mut flagged) = (0_usize, 0_usize);
    for view in views {
        let (Some(all), Some(flags)) = (range_errors(view), view.flags()) else { continue };
        for (error, flags) in all.iter().zip(flags.as_slice()) {
            let excluded = *flags != Flags::empty();
            known += usize::from(error.is_finite() || excluded);
            flagged += usize::from(excluded);
            if !excluded && error.is_finite() {
                errors.push(error.abs());
            }
        }
    }
    if known == 0 {
        return None;
    }
    let half = modulation.map_or(f64::INFINITY, |modulation| modulation.ambiguity_interval_m() / 2.0);
    let right = errors.iter().filter(|error| **error < half).count();
    Some(RangeTruth {
        range_error_median_m: quantile(&mut errors, 0.5),
        range_error_p95_m: quantile(&mut errors, 0.95),
        wrap_count_right_fraction: right as f64 / errors.len().max(1) as f64,
        flagged_fraction: flagged as f64 / known as f64,
        pixels: errors.len(),
    })
}
