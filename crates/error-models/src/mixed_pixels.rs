//! Whether a pixel lies between the surfaces at its two sides and on neither.

use range_image::Raster;

use crate::MixedPixelOptions;

/// Row, column and the two diagonals, as steps of `(column, row)`.
const DIRECTIONS: [[isize; 2]; 4] = [[1, 0], [0, 1], [1, 1], [1, -1]];

/// The test at any pixel of one frame.
pub(crate) struct MixedPixelTest<'a> {
    range: &'a Raster<f32>,
    sigma: &'a Raster<f32>,
    options: MixedPixelOptions,
}

/// The surface at one side of a pixel, continued to it.
#[derive(Clone, Copy)]
struct Continued {
    range: f32,
    /// Variance of its difference to the pixel, as a multiple of the variance of one range.
    variance_factor: f32,
    /// Whether it was continued over two pixels, and not just taken over from one.
    slope_known: bool,
}

impl Continued {
    /// Continues two ranges, `gap` and `gap + 1` pixels away, straight in inverse range. `None` if the surface
    /// turns away before it reaches the pixel's ray.
    fn over(gap: f32, first: f32, second: f32) -> Option<Self> {
        let inverse = (gap + 1.0) / first - gap / second;
        let range = 1.0 / inverse;
        let weights = [(gap + 1.0) * (range / first).powi(2), gap * (range / second).powi(2)];
        let variance_factor = 1.0 + weights[0] * weights[0] + weights[1] * weights[1];
        (inverse > 0.0).then_some(Self { range, variance_factor, slope_known: true })
    }
}

impl<'a> MixedPixelTest<'a> {
    /// Both planes must have one size.
    pub(crate) fn new(range: &'a Raster<f32>, sigma: &'a Raster<f32>, options: MixedPixelOptions) -> Self {
        Self { range, sigma, options }
    }

    /// Whether the pixel is mixed along any of the directions.
    pub(crate) fn is_mixed(&self, col: usize, row: usize) -> bool {
        let Some(range) = self.at(col, row, [0, 0], 0) else { return false };
        let sigma = self.sigma.get(col, row).copied().filter(|sigma| sigma.is_finite());
        let sigma = sigma.unwrap_or(self.options.unknown_sigma_m as f32);
        DIRECTIONS.into_iter().any(|step| self.is_mixed_along(col, row, step, range, sigma))
    }

    fn is_mixed_along(&self, col: usize, row: usize, step: [isize; 2], range: f32, sigma: f32) -> bool {
        let same_surface = self.threshold(sigma, 2.0);
        let supported = |side: isize| self.at(col, row, step, side).is_none_or(|n| (n - range).abs() <= same_surface);
        if supported(-1) || supported(1) {
            return false;
        }
        match [-1, 1].map(|side| self.continued(col, row, step, side, range, sigma)) {
            // Three pixels alone are no surfaces: any tilted plane would look like that at the frame's corner.
            [Some(a), Some(b)] => (a.slope_known || b.slope_known) && self.is_between(range, sigma, a, b),
            _ => false,
        }
    }

    /// Whether the range lies between two continued surfaces, significantly away from both.
    fn is_between(&self, range: f32, sigma: f32, a: Continued, b: Continued) -> bool {
        let (near, far) = if a.range < b.range { (a, b) } else { (b, a) };
        range - near.range > self.threshold(sigma, near.variance_factor)
            && far.range - range > self.threshold(sigma, far.variance_factor)
    }

    /// The surface at one side, continued to the pixel.
    ///
    /// It begins with the neighbour if that continues the two pixels behind it. Otherwise the neighbour may be
    /// mixed as well: the surface begins behind it if the three ranges are monotone, as at a blurred edge.
    /// Failing that, the neighbour's own range stands for the surface.
    fn continued(
        &self,
        col: usize,
        row: usize,
        step: [isize; 2],
        side: isize,
        range: f32,
        sigma: f32,
    ) -> Option<Continued> {
        let first = self.at(col, row, step, side)?;
        let alone = Continued { range: first, variance_factor: 2.0, slope_known: false };
        let Some(second) = self.at(col, row, step, 2 * side) else { return Some(alone) };
        let Some(third) = self.at(col, row, step, 3 * side) else { return Continued::over(1.0, first, second) };
        let continues =
            |surface: Continued| (surface.range - first).abs() <= self.threshold(sigma, surface.variance_factor);
        if Continued::over(1.0, second, third).is_some_and(continues) {
            return Continued::over(1.0, first, second);
        }
        let monotone = (first - range) * (second - first) > 0.0;
        if monotone { Continued::over(2.0, second, third) } else { Some(alone) }
    }

    /// Largest distance that noise, or the floor, explains.
    fn threshold(&self, sigma: f32, variance_factor: f32) -> f32 {
        (self.options.sigmas as f32 * sigma * variance_factor.sqrt()).max(self.options.floor_m as f32)
    }

    /// The range `count` steps away; `None` outside the frame and where there is no positive range.
    fn at(&self, col: usize, row: usize, [dx, dy]: [isize; 2], count: isize) -> Option<f32> {
        let col = col.checked_add_signed(dx * count)?;
        let row = row.checked_add_signed(dy * count)?;
        self.range.get(col, row).copied().filter(|range| *range > 0.0 && range.is_finite())
    }
}
