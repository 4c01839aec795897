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

/// A range with its variance.
#[derive(Clone, Copy)]
struct Measured {
    range: f32,
    variance: f32,
}

/// The surface at one side of a pixel, continued to it.
#[derive(Clone, Copy)]
struct Continued {
    at_pixel: Measured,
    /// Whether it was continued over two pixels, and not just taken over from one.
    slope_known: bool,
}

impl Continued {
    /// Continues two ranges, `gap` and `gap + 1` pixels away, straight in inverse range. `None` if the surface
    /// turns away before it reaches the pixel's ray.
    fn over(gap: f32, first: Measured, second: Measured) -> Option<Self> {
        let inverse = (gap + 1.0) / first.range - gap / second.range;
        let range = 1.0 / inverse;
        let weights = [(gap + 1.0) * (range / first.range).powi(2), gap * (range / second.range).powi(2)];
        let variance = weights[0] * weights[0] * first.variance + weights[1] * weights[1] * second.variance;
        (inverse > 0.0).then_some(Self { at_pixel: Measured { range, variance }, slope_known: true })
    }
}

impl<'a> MixedPixelTest<'a> {
    /// Both planes must have one size.
    pub(crate) fn new(range: &'a Raster<f32>, sigma: &'a Raster<f32>, options: MixedPixelOptions) -> Self {
        Self { range, sigma, options }
    }

    /// Whether the pixel is mixed along any of the directions.
    pub(crate) fn is_mixed(&self, col: usize, row: usize) -> bool {
        let Some(pixel) = self.at(col, row, [0, 0], 0) else { return false };
        DIRECTIONS.into_iter().any(|step| self.is_mixed_along(col, row, step, pixel))
    }

    fn is_mixed_along(&self, col: usize, row: usize, step: [isize; 2], pixel: Measured) -> bool {
        let supported = |side: isize| self.at(col, row, step, side).is_none_or(|n| !self.differ(pixel, n));
        if supported(-1) || supported(1) {
            return false;
        }
        match [-1, 1].map(|side| self.continued(col, row, step, side, pixel)) {
            // Three pixels alone are no surfaces: any tilted plane would look like that at the frame's corner.
            [Some(a), Some(b)] => (a.slope_known || b.slope_known) && self.is_between(pixel, a.at_pixel, b.at_pixel),
            _ => false,
        }
    }

    /// Whether the range lies between two continued surfaces, significantly away from both.
    fn is_between(&self, pixel: Measured, a: Measured, b: Measured) -> bool {
        let between = (pixel.range - a.range) * (b.range - pixel.range) > 0.0;
        between && self.differ(pixel, a) && self.differ(pixel, b)
    }

    /// The surface at one side, continued to the pixel.
    ///
    /// It begins with the neighbour if that continues the two pixels behind it. Otherwise the neighbour may be
    /// mixed as well: the surface begins behind it if the three ranges are monotone, as at a blurred edge.
    /// Failing that, the neighbour's own range stands for the surface.
    fn continued(&self, col: usize, row: usize, step: [isize; 2], side: isize, pixel: Measured) -> Option<Continued> {
        let first = self.at(col, row, step, side)?;
        let alone = Continued { at_pixel: first, slope_known: false };
        let Some(second) = self.at(col, row, step, 2 * side) else { return Some(alone) };
        let Some(third) = self.at(col, row, step, 3 * side) else { return Continued::over(1.0, first, second) };
        if Continued::over(1.0, second, third).is_some_and(|surface| !self.differ(first, surface.at_pixel)) {
            return Continued::over(1.0, first, second);
        }
        let monotone = (first.range - pixel.range) * (second.range - first.range) > 0.0;
        if monotone { Continued::over(2.0, second, third) } else { Some(alone) }
    }

    /// Whether two ranges are further apart than their noise and the floor explain.
    fn differ(&self, a: Measured, b: Measured) -> bool {
        let variance = a.variance + b.variance + (self.options.floor_m * self.options.floor_m) as f32;
        (a.range - b.range).abs() > self.options.sigmas as f32 * variance.sqrt()
    }

    /// The range `count` steps away; `None` outside the frame and where there is no positive range.
    fn at(&self, col: usize, row: usize, [dx, dy]: [isize; 2], count: isize) -> Option<Measured> {
        let col = col.checked_add_signed(dx * count)?;
        let row = row.checked_add_signed(dy * count)?;
        let range = self.range.get(col, row).copied().filter(|range| *range > 0.0 && range.is_finite())?;
        let sigma = self.sigma.get(col, row).copied().filter(|sigma| sigma.is_finite());
        let sigma = sigma.unwrap_or(self.options.unknown_sigma_m as f32);
        Some(Measured { range, variance: sigma * sigma })
    }
}
