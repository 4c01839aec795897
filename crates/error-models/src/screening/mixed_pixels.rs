//! Whether a pixel lies between the surfaces at its two sides and on neither.

use std::f64::consts::TAU;

use range_image::Raster;

use crate::MixedPixelOptions;
use crate::screening::plane_block::is_corner_of_a_plane;
use crate::screening::straight_line::is_on_a_straight_line;

/// Row, column and the two diagonals, as steps of `(column, row)`.
const DIRECTIONS: [[isize; 2]; 4] = [[1, 0], [0, 1], [1, 1], [1, -1]];

/// The test at any pixel of one frame.
pub(crate) struct MixedPixelTest<'a> {
    range: &'a Raster<f32>,
    sigma: &'a Raster<f32>,
    amplitude: &'a Raster<f32>,
    options: MixedPixelOptions,
    /// Phase of a metre of range; zero where the modulation is not known.
    radians_per_metre: f32,
}

/// Mixed pixels side by side that an edge may have.
const WIDEST_EDGE: usize = 3;

/// Distance from the nearer surface, in thresholds, from which on a straight line of pixels tells a surface: of mixed ones
/// the shares of both surfaces differ along an edge, which stands out of the noise only there. With 2 in place of 3 a fifth
/// of the mixed pixels of single frames is lost and, of means of 64, a seventh of the false flags.
const TELLING: f32 = 3.0;

/// Part by which the light of a pixel must differ from that of a mixture. Edges along a row or column are straight, too;
/// their light is what both surfaces return. With 0.02 and 0.1, 86 and 91 % of the mixed pixels stay flagged instead of 88 %,
/// and 43 and 54 % of the narrow surfaces instead of 47 % (with lengths added up, where phases are alike).
const OTHER_LIGHT: f32 = 0.05;

/// A range with its variance.
#[derive(Clone, Copy)]
struct Measured {
    range: f32,
    variance: f32,
}

impl Measured {
    /// Continues two ranges, `gap` and `gap + 1` pixels away, straight in inverse range. `None` if the surface
    /// turns away before it reaches the pixel's ray.
    fn continued(gap: f32, first: Self, second: Self) -> Option<Self> {
        let inverse = (gap + 1.0) / first.range - gap / second.range;
        let range = 1.0 / inverse;
        let weights = [(gap + 1.0) * (range / first.range).powi(2), gap * (range / second.range).powi(2)];
        let variance = weights[0] * weights[0] * first.variance + weights[1] * weights[1] * second.variance;
        (inverse > 0.0).then_some(Self { range, variance })
    }
}

/// The surface at one side of a pixel, continued to it.
#[derive(Clone, Copy)]
struct Surface {
    at_pixel: Measured,
    /// How far the surface may lie from its continuation, metre.
    bend: f32,
}

impl<'a> MixedPixelTest<'a> {
    /// Range, sigma and amplitude must have one size.
    pub(crate) fn new([range, sigma, amplitude]: [&'a Raster<f32>; 3], options: MixedPixelOptions) -> Self {
        let radians_per_metre = options.ambiguity_interval_m.map_or(0.0, |interval_m| (TAU / interval_m) as f32);
        Self { range, sigma, amplitude, options, radians_per_metre }
    }

    /// Whether the pixel is mixed along any of the directions, and on no surface of its own.
    pub(crate) fn is_mixed(&self, col: usize, row: usize) -> bool {
        let Some(pixel) = self.at(col, row, [0, 0], 0) else { return false };
        let across = DIRECTIONS.into_iter().filter_map(|step| Some((self.mixed_along(col, row, step, pixel)?, step)));
        let Some((jump, step)) = across.max_by(|a, b| a.0.total_cmp(&b.0)) else { return false };
        let beside = |dx: isize, dy: isize| self.with_floor(col, row, [dx, dy], 1);
        !is_corner_of_a_plane(beside) && !self.is_on_a_narrow_surface(col, row, step, pixel, jump)
    }

    /// Whether the pixel continues a line of others and returns other light than a mixture of its neighbours across would.
    fn is_on_a_narrow_surface(&self, col: usize, row: usize, step: [isize; 2], pixel: Measured, jump: f32) -> bool {
        jump > TELLING * self.threshold(pixel.variance)
            && self.has_light_of_its_own(col, row, step, pixel)
            && DIRECTIONS.into_iter().any(|along| {
                let line = |count: isize| self.with_floor(col, row, along, count);
                is_on_a_straight_line(line)
            })
    }

    /// Whether the amplitude is not that of a mixture of those at both sides. A mixture is the sum of two phasors, each with its
    /// share; in the direction of the pixel's phase, which is α and β from those at its sides, it has the length
    /// `a b sin(α + β) / (a sin α + b sin β)`. Where the modulation is not known, phases are taken for so near that lengths add up.
    fn has_light_of_its_own(&self, col: usize, row: usize, step: [isize; 2], pixel: Measured) -> bool {
        let side = |count: isize| {
            let neighbour = self.at(col, row, step, count)?;
            let (col, row) = place(col, row, step, count)?;
            Some((*self.amplitude.get(col, row)?, (neighbour.range - pixel.range).abs()))
        };
        let (Some((a, to_a)), Some((b, to_b))) = (side(-1), side(1)) else { return false };
        let of_phase = |distance: f32| (self.radians_per_metre * distance).sin();
        let across = |distance: f32| if self.radians_per_metre > 0.0 { of_phase(distance) } else { distance };
        // Beyond half an interval from each other no mixture lies between two surfaces.
        let mixture = a * b * across(to_a + to_b) / (a * across(to_a) + b * across(to_b));
        let amplitude = self.amplitude[(col, row)];
        mixture <= 0.0 || (amplitude / mixture).ln().abs() > OTHER_LIGHT
    }

    /// How far the pixel is from the nearer of two surfaces that it is mixed of, metre.
    fn mixed_along(&self, col: usize, row: usize, step: [isize; 2], pixel: Measured) -> Option<f32> {
        let supported = |side: isize| self.at(col, row, step, side).is_none_or(|other| !self.differ(pixel, other, 0.0));
        if supported(-1) || supported(1) {
            return None;
        }
        let [a, b] = [-1, 1].map(|side| self.surface(col, row, step, side, pixel));
        let (a, b) = (a?, b?);
        let from = |surface: Surface| (pixel.range - surface.at_pixel.range).abs();
        self.is_between(pixel, a, b).then(|| from(a).min(from(b)))
    }

    /// Whether the range lies between two continued surfaces, significantly away from both.
    fn is_between(&self, pixel: Measured, a: Surface, b: Surface) -> bool {
        let between = (pixel.range - a.at_pixel.range) * (b.at_pixel.range - pixel.range) > 0.0;
        between && self.differ(pixel, a.at_pixel, a.bend) && self.differ(pixel, b.at_pixel, b.bend)
    }

    /// The surface at one side, continued to the pixel; `None` where a single pixel is left before the frame's rim or a hole,
    /// which may belong to a surface of any tilt.
    ///
    /// It begins with the first pixel that continues the two behind it. Pixels before that may be mixed as well, up to two, if
    /// the ranges are monotone, as at a blurred edge. Failing that, the neighbour and the one behind it are a surface of their
    /// own, of which nothing tells the bend: it may be as large as the step between the two.
    fn surface(&self, col: usize, row: usize, step: [isize; 2], side: isize, pixel: Measured) -> Option<Surface> {
        let at = |count: usize| self.at(col, row, step, count as isize * side);
        let mut before = pixel;
        for gap in 0..WIDEST_EDGE {
            let [Some(first), Some(second), Some(third)] = [1, 2, 3].map(|count| at(gap + count)) else { break };
            if Measured::continued(1.0, second, third).is_some_and(|on| !self.differ(first, on, 0.0)) {
                return Some(Surface { at_pixel: Measured::continued(gap as f32 + 1.0, first, second)?, bend: 0.0 });
            }
            if (first.range - before.range) * (second.range - first.range) <= 0.0 {
                break;
            }
            before = first;
        }
        let (first, second) = (at(1)?, at(2)?);
        let at_pixel = Measured::continued(1.0, first, second)?;
        Some(Surface { at_pixel, bend: self.beyond_noise(first, second) })
    }

    /// How much further two ranges are apart than their noise explains, metre.
    fn beyond_noise(&self, a: Measured, b: Measured) -> f32 {
        let noise = self.options.sigmas as f32 * (a.variance + b.variance).sqrt();
        ((a.range - b.range).abs() - noise).max(0.0)
    }

    /// Whether two ranges are further apart than a bend, their noise and the floor explain.
    fn differ(&self, a: Measured, b: Measured, bend: f32) -> bool {
        (a.range - b.range).abs() > bend + self.threshold(a.variance + b.variance)
    }

    /// What a difference of such a variance, and the floor, may reach, metre.
    fn threshold(&self, variance: f32) -> f32 {
        self.options.sigmas as f32 * (variance + (self.options.floor_m * self.options.floor_m) as f32).sqrt()
    }

    /// Range and variance with the floor.
    fn with_floor(&self, col: usize, row: usize, step: [isize; 2], count: isize) -> Option<[f64; 2]> {
        let Measured { range, variance } = self.at(col, row, step, count)?;
        Some([f64::from(range), f64::from(variance) + self.options.floor_m * self.options.floor_m])
    }

    /// The range `count` steps away; `None` outside the frame and where there is no positive range.
    fn at(&self, col: usize, row: usize, step: [isize; 2], count: isize) -> Option<Measured> {
        let (col, row) = place(col, row, step, count)?;
        let range = self.range.get(col, row).copied().filter(|range| *range > 0.0 && range.is_finite())?;
        let sigma = self.sigma.get(col, row).copied().filter(|sigma| sigma.is_finite());
        let sigma = sigma.unwrap_or(self.options.unknown_sigma_m as f32);
        Some(Measured { range, variance: sigma * sigma })
    }
}

/// Column and row `count` steps away; the frame may end before.
fn place(col: usize, row: usize, [dx, dy]: [isize; 2], count: isize) -> Option<(usize, usize)> {
    Some((col.checked_add_signed(dx * count)?, row.checked_add_signed(dy * count)?))
}
