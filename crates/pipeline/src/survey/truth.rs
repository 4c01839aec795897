//! Comparison with the truth of a simulated survey.

use nalgebra::Isometry3;
use range_image::{Flags, Modulation, Raster};
use serde::Serialize;
use statistics::{Thinning, quantile};

use crate::survey::view::View;
use commands::Tape;

/// What is true of one view.
#[derive(Debug, Clone)]
pub struct ViewTruth {
    /// True range along the ray of each pixel's centre, metre; NaN where nothing is hit.
    pub range: Raster<f32>,
    /// True pose, where the survey states it.
    pub world_from_camera: Option<Isometry3<f64>>,
}

/// How far the ranges of one or of all views are from the truth, on the pixels that no flag excludes.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
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

impl RangeTruth {
    /// Writes it, or takes it over.
    pub(crate) fn carry(&mut self, tape: &mut Tape) {
        let Self { range_error_median_m, range_error_p95_m, wrap_count_right_fraction, flagged_fraction, pixels } =
            self;
        let numbers = [range_error_median_m, range_error_p95_m, wrap_count_right_fraction, flagged_fraction];
        for number in numbers {
            tape.number(number);
        }
        tape.count(pixels);
    }
}

/// Signed errors of the pixels of a view, metre; NaN where there is nothing to compare.
///
/// While the range is still wrapped, the error is taken modulo the ambiguity interval, so that the figures of
/// all stages can be compared.
pub fn range_errors(view: &View, range: &Raster<f32>) -> Option<Vec<f64>> {
    let truth = view.truth.as_ref()?;
    let wrapped = view.wrapped_to();
    let error = |(range, truth): (&f32, &f32)| {
        let difference = f64::from(*range) - f64::from(*truth);
        wrapped.map_or(difference, |modulation| wrap(difference, modulation))
    };
    Some(range.as_slice().iter().zip(truth.range.as_slice()).map(error).collect())
}

/// A difference of ranges brought into half an ambiguity interval around zero.
pub fn wrap(difference_m: f64, modulation: Modulation) -> f64 {
    let interval = modulation.ambiguity_interval_m();
    difference_m - (difference_m / interval).round() * interval
}

/// The figures of one view; `None` where it has no truth or no ranges.
pub fn evaluate(view: &View) -> Option<RangeTruth> {
    let mut tally = TruthTally::default();
    tally.add(view, &view.snapshot()?.range, Thinning::ALL);
    tally.figures()
}

/// Counts and thinned errors of views, one after the other.
#[derive(Debug, Default)]
pub struct TruthTally {
    /// Absolute errors of unflagged pixels, metre.
    errors: Vec<f64>,
    /// Pixels with a true range, those of them with a flag, unflagged pixels with an error, and those of them whose number
    /// of whole intervals is right.
    known: usize,
    flagged: usize,
    compared: usize,
    right: usize,
    views: usize,
}

impl TruthTally {
    /// Adds a view with its ranges as they are now.
    pub fn add(&mut self, view: &View, range: &Raster<f32>, thinning: Thinning) {
        let (Some(all), Some(flags)) = (range_errors(view, range), view.flags()) else { return };
        let half = view.modulation.map_or(f64::INFINITY, |modulation| modulation.ambiguity_interval_m() / 2.0);
        let flags = flags.as_slice();
        for (error, flags) in all.iter().zip(flags) {
            let excluded = *flags != Flags::empty();
            self.known += usize::from(error.is_finite() || excluded);
            self.flagged += usize::from(excluded);
            if !excluded && error.is_finite() {
                self.compared += 1;
                self.right += usize::from(error.abs() < half);
            }
        }
        let usable = |pixel: &usize| flags[*pixel].is_empty() && all[*pixel].is_finite();
        let taken = thinning.indices(self.views, all.len()).filter(usable);
        self.errors.extend(taken.map(|pixel| all[pixel].abs()));
        self.views += 1;
    }

    /// Writes it, or adds another part of the views.
    pub(crate) fn carry(&mut self, tape: &mut Tape) {
        tape.numbers(&mut self.errors);
        let Self { known, flagged, compared, right, views, .. } = self;
        for count in [known, flagged, compared, right, views] {
            tape.count(count);
        }
    }

    /// The figures of all of them together.
    pub fn figures(mut self) -> Option<RangeTruth> {
        (self.known > 0).then(|| RangeTruth {
            range_error_median_m: quantile(&mut self.errors, 0.5),
            range_error_p95_m: quantile(&mut self.errors, 0.95),
            wrap_count_right_fraction: self.right as f64 / self.compared.max(1) as f64,
            flagged_fraction: self.flagged as f64 / self.known as f64,
            pixels: self.compared,
        })
    }
}
