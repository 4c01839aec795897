//! A colour for each pixel of a range image.

use camera_model::Camera;
use nalgebra::Isometry3;
use range_image::{RangeFrame, Raster};

use crate::colour::depth_image::{DepthImage, Surfaces, project};

/// How far from a point's place in the image nothing nearer may be seen, pixel: calibration, mounting and the facets of the range image put
/// rims right to about one. Less, and points behind a rim take its colour; more, and more of them take none.
const MARGIN_PX: i64 = 1;
/// Deviations of the noise of two ranges by which a point may lie behind what is seen and be seen itself: one in 370.
const NOISE: f64 = 3.0;

/// Why a point has no colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unseen {
    /// There is no point, or it is one between two surfaces.
    NoPoint,
    /// It is not in the image.
    Outside,
    /// Something lies before it, or beside it by less than a pixel.
    Hidden,
}

/// The colours of all pixels of a range image, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct Colouring {
    /// Red, green and blue as the image has them; or why there are none.
    pub colours: Vec<Result<[f32; 3], Unseen>>,
}

impl Colouring {
    /// How many pixels have a colour, and how many not for a reason.
    pub fn count(&self, reason: Option<Unseen>) -> usize {
        self.colours.iter().filter(|colour| colour.err() == reason).count()
    }
}

/// Colours the points of a range frame from the image of another camera, which was exposed at the same moment and sits at
/// `range_from_colour`.
///
/// `frame` holds corrected ranges of `range_camera`, `image` red, green and blue of `colour_camera`, lens distortion included; both cameras
/// are calibrated. A point has a colour where nothing of the range image lies before it as seen from the other camera, within a pixel
/// about it: colours are interpolated between the four pixels about its distorted image point. What the range camera does not see
/// (outside its image, or without a range) hides nothing.
pub fn colour_points(
    frame: &RangeFrame,
    range_camera: &Camera,
    image: &[Raster<f32>; 3],
    colour_camera: &Camera,
    range_from_colour: &Isometry3<f64>,
) -> Colouring {
    let surfaces = Surfaces::new(frame, range_camera);
    let colour_from_range = range_from_colour.inverse();
    let depths = DepthImage::new(&surfaces, colour_camera, &colour_from_range);
    let colour_px = colour_camera.format.pixel_pitch_mm[0] / colour_camera.interior.principal_distance_mm;
    let painter = Painter { pixels_of_a_pixel: colour_px / surfaces.pixel_rad, surfaces, depths };
    let pixels = (0..frame.height()).flat_map(|row| (0..frame.width()).map(move |col| (col, row)));
    let colour = |(col, row): (usize, usize)| {
        let range = painter.surfaces.range(col, row).ok_or(Unseen::NoPoint)?;
        let point = colour_from_range * range_camera.point([col as f64, row as f64], range);
        let [x, y, depth] = project(colour_camera, &point).ok_or(Unseen::Outside)?;
        let colour = image.each_ref().map(|plane| interpolated(plane, [x, y]));
        let [Some(red), Some(green), Some(blue)] = colour else { return Err(Unseen::Outside) };
        if painter.is_hidden([x, y], depth, (col, row), range) {
            return Err(Unseen::Hidden);
        }
        Ok([red, green, blue])
    };
    Colouring { colours: pixels.map(colour).collect() }
}

struct Painter<'a> {
    surfaces: Surfaces<'a>,
    depths: DepthImage,
    /// Width of a pixel of the colour image in pixels of the range image.
    pixels_of_a_pixel: f64,
}

impl Painter<'_> {
    /// Whether something lies before a point within the margin about its place in the image.
    fn is_hidden(&self, [x, y]: [f64; 2], depth: f64, (col, row): (usize, usize), range: f64) -> bool {
        let noise = NOISE * std::f64::consts::SQRT_2 * self.surfaces.sigma(col, row);
        let slope = self.slope((col, row), range);
        let middle = [x.round() as i64, y.round() as i64];
        let about = (-MARGIN_PX..=MARGIN_PX).flat_map(|dy| (-MARGIN_PX..=MARGIN_PX).map(move |dx| [dx, dy]));
        about.map(|[dx, dy]| [middle[0] + dx, middle[1] + dy]).any(|at| {
            let away = (at[0] as f64 - x).hypot(at[1] as f64 - y) * self.pixels_of_a_pixel;
            // A facet is level along its pixel: its corner lies half a diagonal away.
            let of_surface = slope * (std::f64::consts::FRAC_1_SQRT_2 + away);
            self.depths.at(at).is_some_and(|seen| seen < depth - noise - of_surface)
        })
    }

    /// Most that the range changes from a pixel to one beside it on the same surface, metre.
    fn slope(&self, (col, row): (usize, usize), range: f64) -> f64 {
        let beside = [(-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, -1), (-1, 1), (1, 1)];
        let change = |(dx, dy): (isize, isize)| {
            let other = (col.checked_add_signed(dx)?, row.checked_add_signed(dy)?);
            let there = self.surfaces.range(other.0, other.1)?;
            self.surfaces.joins([(col, row), other], [range, there]).then_some((range - there).abs())
        };
        beside.into_iter().filter_map(change).fold(0.0, f64::max)
    }
}

/// Between the four pixels about a place; `None` outside their middles.
fn interpolated(plane: &Raster<f32>, [x, y]: [f64; 2]) -> Option<f32> {
    let (last_col, last_row) = (plane.width().checked_sub(1)?, plane.height().checked_sub(1)?);
    if !((0.0..=last_col as f64).contains(&x) && (0.0..=last_row as f64).contains(&y)) {
        return None;
    }
    let (col, row) = ((x as usize).min(last_col.saturating_sub(1)), (y as usize).min(last_row.saturating_sub(1)));
    let (right, below) = ((col + 1).min(last_col), (row + 1).min(last_row));
    let (u, v) = ((x - col as f64) as f32, (y - row as f64) as f32);
    let above = plane[(col, row)] * (1.0 - u) + plane[(right, row)] * u;
    let under = plane[(col, below)] * (1.0 - u) + plane[(right, below)] * u;
    Some(above * (1.0 - v) + under * v).filter(|value| value.is_finite())
}
