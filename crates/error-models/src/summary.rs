//! What a correction did to a frame.

/// How one group of terms changed the ranges of a frame: new range minus old range, metre.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct GroupChange {
    /// Mean over the corrected pixels, with its sign; 0 where no pixel was corrected.
    pub mean_m: f64,
    /// Largest absolute value.
    pub largest_m: f64,
}

/// The ledger of one correction: counts of pixels, and the change of the range by group of terms.
///
/// The means of the groups add up to that of the total.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CorrectionSummary {
    /// Pixels of the frame.
    pub pixels: usize,
    /// Pixels whose range was corrected, some of them without the hyperbola (see `outside_span`).
    pub corrected: usize,
    /// Pixels flagged [`OUTSIDE_SPAN`](range_image::Flags::OUTSIDE_SPAN) now: not corrected if their range is
    /// outside the span, corrected by Eq. 14 alone if their amplitude is.
    pub outside_span: usize,
    /// Pixels without a finite range, left as they are.
    pub no_data: usize,
    /// All groups together.
    pub total: GroupChange,
    /// Offset d0.
    pub offset: GroupChange,
    /// Periodic terms d2..d7, or the spline.
    pub periodic: GroupChange,
    /// Signal propagation delay e1, e2, or the surface.
    pub delay: GroupChange,
    /// Polynomial in range.
    pub polynomial: GroupChange,
    /// Amplitude hyperbola.
    pub amplitude: GroupChange,
    /// Fixed pattern.
    pub pattern: GroupChange,
}

/// Position of a group's figures in a [`Tally`].
pub(crate) const TOTAL: usize = 0;
pub(crate) const PERIODIC: usize = 1;
pub(crate) const DELAY: usize = 2;
pub(crate) const AMPLITUDE: usize = 3;
pub(crate) const PATTERN: usize = 4;
pub(crate) const POLYNOMIAL: usize = 5;
/// Number of groups that differ from pixel to pixel, the total among them.
pub(crate) const GROUPS: usize = 6;

/// Running counts and sums of `Δρ`; of one chunk of rows, or of several chunks added in their order.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Tally {
    pub(crate) finite: usize,
    pub(crate) corrected: usize,
    pub(crate) outside_span: usize,
    pub(crate) sum: [f64; GROUPS],
    pub(crate) largest: [f64; GROUPS],
}

impl Tally {
    /// Adds the figures of the next chunk.
    pub(crate) fn add(&mut self, next: &Self) {
        self.finite += next.finite;
        self.corrected += next.corrected;
        self.outside_span += next.outside_span;
        for group in 0..GROUPS {
            self.sum[group] += next.sum[group];
            self.largest[group] = self.largest[group].max(next.largest[group]);
        }
    }

    /// Counts one corrected pixel with its `Δρ` of each group.
    pub(crate) fn count_corrected(&mut self, correction: [f64; GROUPS]) {
        self.corrected += 1;
        for (group, value) in correction.into_iter().enumerate() {
            self.sum[group] += value;
            self.largest[group] = self.largest[group].max(value.abs());
        }
    }

    /// The summary of a frame of `pixels` pixels. `sign` is -1 where `Δρ` was subtracted, 1 where it was added.
    pub(crate) fn summary(&self, pixels: usize, d0: f64, sign: f64) -> CorrectionSummary {
        let count = self.corrected.max(1) as f64;
        let change =
            |group: usize| GroupChange { mean_m: sign * self.sum[group] / count, largest_m: self.largest[group] };
        let offset = if self.corrected > 0 { d0 } else { 0.0 };
        CorrectionSummary {
            pixels,
            corrected: self.corrected,
            outside_span: self.outside_span,
            no_data: pixels - self.finite,
            total: change(TOTAL),
            offset: GroupChange { mean_m: sign * offset, largest_m: offset.abs() },
            periodic: change(PERIODIC),
            delay: change(DELAY),
            polynomial: change(POLYNOMIAL),
            amplitude: change(AMPLITUDE),
            pattern: change(PATTERN),
        }
    }
}
