use nalgebra::Matrix5;
use range_image::Raster;
use statistics::{robust_standard_deviation, upper_median};

use super::components::{Candidate, Region, elliptical_components};
use super::disc_fit::{DiscFit, Window, fit};
use super::ellipse::Ellipse;
use super::options::{CircleOptions, Polarity};
use super::rough_fit::{Look, rough_fit};
use crate::error::Result;
use crate::image::levels::Levels;
use crate::image::noise::noise_deviation;
use crate::image::sampling::bilinear;
use crate::image::smoothing::{filled, gaussian};
use crate::sightings::measured_point::MeasuredPoint;

/// Smoothing before the search, pixel: enough that noise leaves regions whole, and little beside discs of five pixels.
const SMOOTHING_PX: f64 = 0.8;
/// Least span of levels of a candidate in parts of the smallest contrast: smoothing takes half of that of the smallest discs,
/// and noise the ends.
const SPAN_PARTS: f64 = 0.25;
/// A disc whose blur is more than so many of its semi-minor axes has no edge: a spot of light, or a shadow.
const LARGEST_BLUR_PARTS: f64 = 0.8;
/// Two sightings nearer to each other than so many semi-minor axes, and of sizes within as much, are one disc.
const SAME_PARTS: f64 = 0.3;
/// How many times beyond the limits of a disc its first fit may be: its model is simpler, by a few percent of the contrast.
const ROUGHLY: f64 = 1.15;
/// Pixels about another region that its blur may reach.
const FOREIGN_REACH_PX: usize = 2;

/// Points of the edge that are looked at to see how much of it lies in the image.
const EDGE_POINTS: usize = 32;
/// How far inside and outside of it, pixel: beyond the blur.
const EDGE_REACH_PX: f64 = 2.0;
/// Fall of the image at a point of the edge in parts of the median, at least, and the share of points where it must be so: shading
/// and a neighbour's blur take a third, noise of the smallest contrast the rest.
const EVEN: f64 = 0.4;
const EVEN_SHARE: f64 = 0.9;
/// Robust deviation along either side of the edge in parts of the fall: a texture has more.
const QUIET: f64 = 0.2;

fn edge_angles() -> impl Iterator<Item = f64> {
    (0..EDGE_POINTS).map(|k| std::f64::consts::TAU * k as f64 / EDGE_POINTS as f64)
}

/// A disc that was seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CircleSighting {
    /// Centre of the ellipse. That of the circle lies elsewhere, see [`crate::centre_of_circle`].
    pub centre: MeasuredPoint,
    /// The ellipse.
    pub ellipse: Ellipse,
    /// Covariance of `[col, row, semi-major, semi-minor, direction]`, pixel and radian, from the scatter of the pixels about the model. The direction of
    /// a circle is not known: its variance grows beyond all bounds.
    pub covariance: Matrix5<f64>,
    /// Disc less ground, unit of the image: negative where the disc is darker.
    pub contrast: f64,
    /// Value of the ground, unit of the image.
    pub level: f64,
    /// Blur of the edge (standard deviation of a Gaussian, without that of the pixel), pixel.
    pub blur_px: f64,
    /// Standard deviation of unit weight: 1 where the pixels scatter about the model as the image's noise says.
    pub sigma0: f64,
    /// Whether the image ends within the disc: its centre rests on a part of its edge.
    pub touches_border: bool,
    /// Whether pixels on it or beside it are saturated: its size is not trusted, and its centre only if the light falls evenly.
    pub saturated: bool,
}

/// Finds discs and measures the ellipses that they are in the image.
///
/// Candidates are components of the level sets that look like ellipses over a span of levels; each is measured by least squares
/// of a blurred disc on a ground to all pixels about it (maximum likelihood for normal noise). Values need no particular scale;
/// NaN is no value. The sightings come by row, then column, of their centres.
///
/// # Errors
/// [`crate::Error::Invalid`] for options that cannot be met.
///
/// ```
/// use targets::range_image::Raster;
/// use targets::{CircleOptions, find_circles};
///
/// // A disc of radius 6 about (20.3, 15.6), with edges a pixel wide.
/// let disc = |col: usize, row: usize| (6.5 - (col as f32 - 20.3).hypot(row as f32 - 15.6)).clamp(0.0, 1.0);
/// let image = Raster::from_fn(40, 32, |col, row| 100.0 + 50.0 * disc(col, row));
/// let found = find_circles(&image, &CircleOptions::default())?;
/// assert_eq!(found.len(), 1);
/// assert!((found[0].centre.pixel[0] - 20.3).abs() < 0.02 && (found[0].ellipse.mean_radius_px() - 6.0).abs() < 0.02);
/// # Ok::<(), targets::Error>(())
/// ```
pub fn find_circles(image: &Raster<f32>, options: &CircleOptions) -> Result<Vec<CircleSighting>> {
    options.validate()?;
    let Some(whole) = filled(image) else { return Ok(Vec::new()) };
    // Where no pixel has neighbours there is no disc either.
    let noise = options.noise.unwrap_or_else(|| noise_deviation(image)).max(0.0);
    let plateau = Levels::of(image, noise).and_then(|levels| levels.plateau).unwrap_or(f64::INFINITY);
    let smoothed = gaussian(&whole, SMOOTHING_PX);
    let mut found = Vec::new();
    for (sign, left_out) in [(1.0, Polarity::Dark), (-1.0, Polarity::Bright)] {
        if options.polarity != left_out {
            let of_sign = |image: &Raster<f32>| image.map(|value| sign * value);
            let search = Search {
                image: of_sign(image),
                smoothed: of_sign(&smoothed),
                saturation: options.saturation.min(plateau),
                sign: f64::from(sign),
                noise,
                options,
            };
            found.extend(search.sightings());
        }
    }
    let key = |sighting: &CircleSighting| [sighting.centre.pixel[1], sighting.centre.pixel[0]];
    found.sort_by(|a, b| key(a)[0].total_cmp(&key(b)[0]).then(key(a)[1].total_cmp(&key(b)[1])));
    Ok(found)
}

/// The search for discs brighter than their ground, in the image or its negative.
struct Search<'a> {
    image: Raster<f32>,
    smoothed: Raster<f32>,
    saturation: f64,
    /// 1, or −1 in the negative.
    sign: f64,
    noise: f64,
    options: &'a CircleOptions,
}

impl Search<'_> {
    fn sightings(&self) -> Vec<CircleSighting> {
        let span = (SPAN_PARTS * self.options.smallest_contrast_sigmas * self.noise) as f32;
        // The ratio of the axes of a region is less certain than that of the disc.
        let ratio = 1.5 * self.options.largest_axis_ratio;
        let candidates = elliptical_components(&self.smoothed, ratio, span.max(f32::MIN_POSITIVE));
        let mut taken = vec![false; self.smoothed.len()];
        let mut kept: Vec<(DiscFit, CircleSighting)> = Vec::new();
        for candidate in candidates {
            let is_new = |ellipse: &Ellipse| !kept.iter().any(|(other, _)| are_same(&other.ellipse, ellipse));
            let Some(disc) = self.measured(&candidate, &mut taken, is_new) else { continue };
            match kept.iter().position(|(other, _)| are_same(&other.ellipse, &disc.ellipse)) {
                Some(place) if kept[place].0.misfit <= disc.misfit => {}
                Some(place) => kept[place] = (disc, self.sighting(&disc)),
                None => kept.push((disc, self.sighting(&disc))),
            }
        }
        kept.into_iter().map(|(_, sighting)| sighting).collect()
    }

    /// The disc of a candidate, if it is one and new.
    fn measured(
        &self,
        candidate: &Candidate,
        taken: &mut [bool],
        is_new: impl Fn(&Ellipse) -> bool,
    ) -> Option<DiscFit> {
        let region = candidate.region(&self.smoothed, taken);
        let start = region.ellipse;
        let fits = start.semi_axes_px[0] <= 1.5 * self.options.largest_semi_axis_px;
        if !(fits && self.is_mostly_in_image(&start) && self.has_edge_all_round(&start)) {
            return None;
        }
        region.pixels.iter().for_each(|place| taken[*place] = true);
        let foreign = |col: usize, row: usize| self.is_foreign(&region, taken, [col, row]);
        let window = |about: &Ellipse| Window::about(&self.image, about, foreign);
        let roughly = |about: &Ellipse| {
            let disc = rough_fit(&window(about)?, about, self.noise)?;
            (self.is_acceptable(&disc.look, &start, ROUGHLY) && is_new(&disc.look.ellipse)).then_some(disc)
        };
        // Again with the pixels about the ellipse as it is then known.
        let disc = roughly(&start)
            .and_then(|disc| roughly(&disc.look.ellipse))
            .and_then(|disc| fit(&window(&disc.look.ellipse)?, &disc, self.noise));
        region.pixels.iter().for_each(|place| taken[*place] = false);
        disc.filter(|disc| self.is_acceptable(&disc.look(), &start, 1.0))
    }

    /// Whether a pixel belongs to another bright region, or lies where that region's blur may reach.
    fn is_foreign(&self, region: &Region, own: &[bool], [col, row]: [usize; 2]) -> bool {
        let (width, height) = (self.smoothed.width(), self.smoothed.height());
        let reach = FOREIGN_REACH_PX;
        let mut rows = row.saturating_sub(reach)..(row + reach + 1).min(height);
        let columns = col.saturating_sub(reach)..(col + reach + 1).min(width);
        let is_other = |place: usize| self.smoothed.as_slice()[place] >= region.level && !own[place];
        !own[row * width + col] && rows.any(|row| columns.clone().any(|col| is_other(row * width + col)))
    }

    /// Whether a fit is a disc that is looked for; `slack` times the limits are let pass.
    fn is_acceptable(&self, disc: &Look, start: &Ellipse, slack: f64) -> bool {
        let [long, short] = disc.ellipse.semi_axes_px;
        let options = self.options;
        short * slack >= options.smallest_semi_axis_px
            && long <= slack * options.largest_semi_axis_px
            && long <= slack * options.largest_axis_ratio * short
            && start.parts(&start.to_unit_circle(), disc.ellipse.centre) <= 0.5 * slack
            && (0.5 / slack..=2.0 * slack).contains(&(disc.ellipse.mean_radius_px() / start.mean_radius_px()))
            && disc.contrast * slack >= options.smallest_contrast_sigmas * self.noise
            && disc.blur_px <= slack * LARGEST_BLUR_PARTS * short
            && disc.misfit <= slack * options.largest_misfit
            && self.is_mostly_in_image(&disc.ellipse)
    }

    /// Whether more than half of the edge lies in the image: with less the centre is a guess.
    fn is_mostly_in_image(&self, ellipse: &Ellipse) -> bool {
        let inside = |value: f64, size: usize| value > -0.5 && value < size as f64 - 0.5;
        let size = [self.image.width(), self.image.height()];
        let is_inside = |point: [f64; 2]| inside(point[0], size[0]) && inside(point[1], size[1]);
        2 * edge_angles().filter(|angle| is_inside(ellipse.point(*angle))).count() > EDGE_POINTS
    }

    /// Whether the image falls from inside to outside all along an ellipse: quickly said of what is no disc.
    fn has_edge_all_round(&self, ellipse: &Ellipse) -> bool {
        let reach = (EDGE_REACH_PX / ellipse.semi_axes_px[1]).min(0.5);
        let value = |angle: f64, parts: f64| {
            let ([col, row], centre) = (ellipse.point(angle), ellipse.centre);
            let place = [centre[0] + parts * (col - centre[0]), centre[1] + parts * (row - centre[1])];
            f64::from(bilinear(&self.smoothed, place))
        };
        let sides = edge_angles().map(|angle| [1.0 - reach, 1.0 + reach].map(|parts| value(angle, parts)));
        let sides: Vec<[f64; 2]> = sides.filter(|sides| sides.iter().all(|value| value.is_finite())).collect();
        let fall = upper_median(&mut sides.iter().map(|[inside, outside]| inside - outside).collect::<Vec<_>>());
        let even = sides.iter().filter(|[inside, outside]| inside - outside >= EVEN * fall).count();
        let is_quiet = |side: usize| {
            let values: Vec<f64> = sides.iter().map(|sides| sides[side]).collect();
            robust_standard_deviation(&values) <= QUIET * fall + self.noise
        };
        fall > 0.0 && even as f64 >= EVEN_SHARE * sides.len() as f64 && is_quiet(0) && is_quiet(1)
    }

    fn sighting(&self, disc: &DiscFit) -> CircleSighting {
        let covariance = disc.covariance;
        CircleSighting {
            centre: MeasuredPoint {
                pixel: disc.ellipse.centre,
                covariance: covariance.fixed_view::<2, 2>(0, 0).into_owned(),
            },
            ellipse: disc.ellipse,
            covariance,
            contrast: self.sign * disc.contrast,
            level: self.sign * disc.level,
            blur_px: disc.blur_px,
            sigma0: disc.sigma0,
            touches_border: self.touches_border(&disc.ellipse),
            saturated: self.is_saturated(&disc.ellipse),
        }
    }

    fn touches_border(&self, ellipse: &Ellipse) -> bool {
        let (sine, cosine) = ellipse.direction_rad.sin_cos();
        let [long, short] = ellipse.semi_axes_px;
        let half = [(long * cosine).hypot(short * sine), (long * sine).hypot(short * cosine)];
        let last = [self.image.width(), self.image.height()].map(|size| size as f64 - 0.5);
        (0..2).any(|k| ellipse.centre[k] - half[k] < -0.5 || ellipse.centre[k] + half[k] > last[k])
    }

    fn is_saturated(&self, ellipse: &Ellipse) -> bool {
        let Some(reach) = Some(1.5 * ellipse.semi_axes_px[0]).filter(|reach| reach.is_finite()) else { return false };
        let matrix = ellipse.to_unit_circle();
        let range = |centre: f64, size: usize| {
            (centre - reach).max(0.0) as usize..((centre + reach).max(-1.0) + 1.0).min(size as f64) as usize
        };
        range(ellipse.centre[1], self.image.height()).any(|row| {
            range(ellipse.centre[0], self.image.width()).any(|col| {
                ellipse.parts(&matrix, [col as f64, row as f64]) < 1.5
                    && self.sign * f64::from(self.image[(col, row)]) >= self.saturation
            })
        })
    }
}

fn are_same(a: &Ellipse, b: &Ellipse) -> bool {
    let near = SAME_PARTS * a.semi_axes_px[1].min(b.semi_axes_px[1]);
    let apart = (a.centre[0] - b.centre[0]).hypot(a.centre[1] - b.centre[1]);
    apart <= near && (a.mean_radius_px() - b.mean_radius_px()).abs() <= near
}
