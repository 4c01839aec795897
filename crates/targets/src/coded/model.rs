//! The image that a ring must have: what covers a part of it, or is another ring, leaves residuals in some sector.
//!
//! A pixel's value is `level + contrast · E`, E the disc and the set sectors, their edges blurred as that of the disc is. Distances to
//! the edges are those of [`crate::circles::disc_model`], to first order.

use range_image::Raster;
use statistics::{bonferroni, chi_squared_limit};

use super::codes::Code;
use super::decode::whole_blur;
use super::{GROUND, RING};
use crate::circles::find::CircleSighting;
use crate::image::normal_table::NormalTable;

/// Probability at which noise makes a sound ring none.
const LEVEL: f64 = 1e-3;
/// How far the ring may lie from the disc's ellipse made larger, in radii of the disc: tilted by 45° it does, where the disc is as wide
/// as a twentieth of the principal distance. More, and half a sector that is covered is not seen.
const OFF_PARTS: f64 = 0.1;
/// How much farther the edge of a saturated disc seems to lie, in deviations of the blur that it seems to have: where the sensor ends
/// at 0.6 of the light.
const SATURATED_BLURS: f64 = 1.0;
/// Light that falls off, and what a camera's sharpening leaves, in parts of the contrast: a thing over the ring that differs by less is
/// not seen.
const UNEVEN: f64 = 0.08;
/// Ground that is looked at beyond the ring, in parts of the free one.
const GROUND_SHARE: f64 = 0.7;

/// A ring with a code, where sector 0 begins at a parameter of the disc's ellipse.
pub(super) struct RingModel<'a> {
    disc: &'a CircleSighting,
    code: Code,
    start_rad: f64,
    /// Deviation of the blur with that of a pixel, pixel.
    blur: f64,
    table: NormalTable,
}

impl<'a> RingModel<'a> {
    pub(super) fn new(disc: &'a CircleSighting, code: Code, start_rad: f64) -> Self {
        Self { disc, code, start_rad, blur: whole_blur(disc), table: NormalTable::new() }
    }

    /// Whether the pixels about the disc are as the code has them, `noise` the deviation of one: in each sector the squares of
    /// the residuals over their variance are no more than chance makes them.
    pub(super) fn agrees(&self, image: &Raster<f32>, noise: f64) -> bool {
        let bits = self.code.bits;
        let (mut squares, mut counts) = (vec![0.0; bits], vec![0_usize; bits]);
        let (contrast, ellipse) = (self.disc.contrast, self.disc.ellipse);
        let own = (self.disc.sigma0 * noise / contrast).powi(2) + UNEVEN * UNEVEN;
        let axes = (self.disc.covariance[(2, 2)] + self.disc.covariance[(3, 3)]).sqrt();
        let saturated = if self.disc.saturated { SATURATED_BLURS * self.blur } else { 0.0 };
        let off = (OFF_PARTS * ellipse.mean_radius_px()).hypot(RING[1] * axes.hypot(saturated));
        let reach = GROUND * ellipse.semi_axes_px[0];
        let span = |middle: f64, size: usize| {
            (middle - reach).ceil().max(0.0) as usize..((middle + reach).floor() + 1.0).clamp(0.0, size as f64) as usize
        };
        for row in span(ellipse.centre[1], image.height()) {
            for col in span(ellipse.centre[0], image.width()) {
                let Some(seen) = self.pixel([col as f64, row as f64]) else { continue };
                let value = (f64::from(image[(col, row)]) - self.disc.level) / contrast;
                if value.is_nan() {
                    continue;
                }
                let residual = value - seen.value;
                squares[seen.sector] += residual * residual / (own + (off * seen.slope).powi(2));
                counts[seen.sector] += 1;
            }
        }
        let level = bonferroni(LEVEL, bits);
        let is_sound = |sector: usize| {
            let count = counts[sector] as f64;
            count > 0.0 && squares[sector] <= chi_squared_limit(count, level)
        };
        (0..bits).all(is_sound)
    }

    /// What a pixel of the ring and about it shows; `None` within the disc and beyond the ground that belongs to the ring.
    fn pixel(&self, [col, row]: [f64; 2]) -> Option<Seen> {
        let ellipse = &self.disc.ellipse;
        let ([long, short], (sine, cosine)) = (ellipse.semi_axes_px, ellipse.direction_rad.sin_cos());
        let (dx, dy) = (col - ellipse.centre[0], row - ellipse.centre[1]);
        let q = [(cosine * dx + sine * dy) / long, (cosine * dy - sine * dx) / short];
        let parts = q[0].hypot(q[1]);
        if !(parts > 1.0 && parts < RING[1] + GROUND_SHARE * (GROUND - RING[1])) {
            return None;
        }
        // Pixels from one ellipse to the next, and across a line through the centre.
        let radial = parts * parts / (q[0] / long).hypot(q[1] / short);
        let step = std::f64::consts::TAU / self.code.bits as f64;
        let place = (q[1].atan2(q[0]) - self.start_rad).rem_euclid(std::f64::consts::TAU) / step;
        let sector = (place as usize).min(self.code.bits - 1);
        let beyond = |edge: usize| {
            let (sine, cosine) = (self.start_rad + edge as f64 * step).sin_cos();
            (cosine * q[1] - sine * q[0]) / (cosine / short).hypot(sine / long)
        };
        // Share on the far side of an edge, and its slope.
        let share = |distance: f64| {
            let (profile, density) = self.table.profile(distance / self.blur);
            (0.5 * (1.0 + profile), density / self.blur)
        };
        let set = |sector: usize| f64::from(u8::from(self.code.is_set(sector)));
        let [before, own, next] = [sector + self.code.bits - 1, sector, sector + 1].map(set);
        let ((first, first_slope), (last, last_slope)) = (share(beyond(sector)), share(beyond(sector + 1)));
        let along = before + (own - before) * first + (next - own) * last;
        let along_slope = (own - before) * first_slope + (next - own) * last_slope;
        let at = |edge: f64| share((parts - edge) * radial / parts);
        let (disc, inner, outer) = (at(1.0), at(RING[0]), at(RING[1]));
        let across = inner.0 - outer.0;
        let across_slope = inner.1.abs() + outer.1.abs();
        Some(Seen {
            sector,
            value: 1.0 - disc.0 + across * along,
            slope: (across_slope * along + disc.1).hypot(across * along_slope),
        })
    }
}

/// What a pixel shows.
struct Seen {
    sector: usize,
    /// E.
    value: f64,
    /// Its slope, 1/pixel.
    slope: f64,
}
