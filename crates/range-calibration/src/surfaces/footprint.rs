//! What the width of a pixel does to its range.
//!
//! A pixel sees a patch of the scene, not a point. On a slanted surface the near part of the patch returns more light, so that the
//! range is shorter than along the pixel's ray: by a millimetre on a floor that is seen at 5 m under 70° by pixels of 0.7°. Such
//! pixels are dark as well as far, and terms of the amplitude and of the range take the place of what they have in common: in a simulated
//! room, the value in the dark came out 1 mm too small, and the squared errors of all terms were 2.0 times their variances; with one ray
//! a pixel, 0.9 times. Where a pixel's patch goes over an edge, its range lies between two surfaces, and it tells nothing of either.
//!
//! With `q = n·e` for a surface's normal n and rays e, ranges are `D/q`, and light from beside the lens on a dull surface comes back as
//! `q/ρ² ~ q³`. The mean over a pixel of width one is `1 + Σ (−2 (q'/q)² − q''/(2q)) / 12` times the range at its centre, summed over
//! columns and rows. Range errors that change with the range are those of all these ranges in their mean.

use camera_model::Camera;
use range_image::{Flags, RangeFrame};
use statistics::mad_scale;

use super::local_planes::{LocalPlane, LocalPlanes};

/// Variance of a place drawn from all of a pixel, pixel widths squared.
const PIXEL_VARIANCE: f64 = 1.0 / 12.0;
/// Largest part of a range that a footprint changes: beyond, the surface is seen edge-on, and its normal does not tell.
const LARGEST: f64 = 3e-3;
/// Standard deviations by which a pixel lies beside the line between opposite neighbours where it, or one of them, goes over an edge: of
/// four directions, one pixel in 4000 of a plane does. Three would take one in 90, five leaves edges of twenty degrees in noise.
const BESIDE: f64 = 4.0;
/// Least scale of what is beside: exact surfaces leave rounding.
const LEAST_SCALE: f64 = 0.1;
/// Standard deviation of a range of which none is stated, metre: their scale is found.
const UNKNOWN_M: f64 = 0.01;

/// What a pixel sees.
#[derive(Clone, Copy)]
pub(super) struct Footprint {
    /// Range of the surface about it over its own: nearly without its noise. One where no surface is found.
    pub(super) range: f64,
    /// Part of the range by which its width changes it; zero where no surface is found.
    pub(super) part: f64,
    /// Standard deviation of the ranges that the pixel sees, part of the range.
    pub(super) spread: f64,
}

/// A frame with its camera and points (NaN where none takes part).
#[derive(Clone, Copy)]
pub(super) struct Surfaced<'a> {
    pub(super) camera: &'a Camera,
    pub(super) frame: &'a RangeFrame,
    pub(super) points: &'a [[f64; 3]],
}

impl Surfaced<'_> {
    /// One a pixel; `None` where the surface is seen edge-on, or the pixel's patch may go over an edge.
    pub(super) fn footprints(&self) -> Vec<Option<Footprint>> {
        let beside: Vec<[f64; 4]> = (0..self.points.len()).map(|index| self.beside(index)).collect();
        let mut known: Vec<f64> =
            beside.iter().flatten().map(|value| value.abs()).filter(|value| value.is_finite()).collect();
        // Deviations that come with the points may have any scale.
        let scale = mad_scale(&mut known).max(LEAST_SCALE);
        let is_beside = |found: &[f64; 4]| found.iter().any(|value| value.abs() > BESIDE * scale);
        let planes = LocalPlanes::new(*self, scale);
        let footprint = |(index, found): (usize, &[f64; 4])| {
            let at_edge = is_beside(found) || self.is_beside_mixed(index);
            if at_edge { None } else { self.footprint(index, planes.about(index)) }
        };
        beside.iter().enumerate().map(footprint).collect()
    }

    /// Standard deviation of a pixel's range, metre.
    pub(super) fn sigma_m(&self, index: usize) -> f64 {
        let sigma = f64::from(self.frame.sigma.as_slice()[index]);
        if sigma > 0.0 && sigma.is_finite() { sigma } else { UNKNOWN_M }
    }

    /// What a pixel sees of the surface about it; `None` where it is seen edge-on.
    fn footprint(&self, index: usize, surface: Option<LocalPlane>) -> Option<Footprint> {
        // A few pixels on narrow things; they tell where the station stands.
        let Some(LocalPlane { normal, range }) = surface else {
            return Some(Footprint { range: 1.0, part: 0.0, spread: 0.0 });
        };
        let width = self.frame.width();
        let (col, row) = ((index % width) as f64, (index / width) as f64);
        let q = |cols: f64, rows: f64| normal.dot(&self.camera.ray([col + cols, row + rows]));
        let centre = q(0.0, 0.0);
        let along = |cols: f64, rows: f64| {
            let [before, after] = [q(-cols, -rows), q(cols, rows)];
            [(after - before) / 2.0 / centre, f64::midpoint(before, after) / centre - 1.0]
        };
        let [[by_col, bent_by_col], [by_row, bent_by_row]] = [along(1.0, 0.0), along(0.0, 1.0)];
        let slope = by_col * by_col + by_row * by_row;
        let part = -PIXEL_VARIANCE * (2.0 * slope + bent_by_col + bent_by_row);
        (part.abs() <= LARGEST).then(|| Footprint { range, part, spread: (PIXEL_VARIANCE * slope).sqrt() })
    }

    /// Distances of a pixel from the lines between opposite neighbours, in standard deviations; NaN where it has none.
    fn beside(&self, index: usize) -> [f64; 4] {
        [(1, 0), (0, 1), (1, 1), (1, -1)].map(|(cols, rows)| {
            let ends = [self.neighbour(index, cols, rows), self.neighbour(index, -cols, -rows)];
            let [Some(before), Some(after)] = ends else { return f64::NAN };
            // One over the depth is linear in the image of a plane.
            let inverse = |at: usize| -1.0 / self.points[at][2];
            let second = (inverse(before) + inverse(after) - 2.0 * inverse(index)) / inverse(index).powi(2);
            let variance =
                self.sigma_m(before).powi(2) + self.sigma_m(after).powi(2) + 4.0 * self.sigma_m(index).powi(2);
            second / variance.sqrt()
        })
    }

    /// Whether a neighbour mixes two surfaces: what is left of it may reach into this pixel.
    fn is_beside_mixed(&self, index: usize) -> bool {
        let around = [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1), (1, -1), (-1, 1)];
        let mut neighbours = around.into_iter().filter_map(|(cols, rows)| self.neighbour(index, cols, rows));
        neighbours.any(|at| self.frame.flags.as_slice()[at].contains(Flags::MIXED_PIXEL))
    }

    /// The pixel that lies so many columns and rows on.
    fn neighbour(&self, index: usize, cols: isize, rows: isize) -> Option<usize> {
        let (width, height) = (self.frame.width(), self.frame.height());
        let (col, row) = ((index % width).checked_add_signed(cols)?, (index / width).checked_add_signed(rows)?);
        (col < width && row < height).then_some(row * width + col)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use camera_model::{InteriorOrientation, LensDistortion};
    use nalgebra::Vector3;
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;
    use range_image::{ImageFormat, Raster};

    use super::*;

    const WIDTH: usize = 41;
    const HEIGHT: usize = 31;

    /// Pixels of 0.6 degrees.
    fn camera() -> Camera {
        let format = ImageFormat::new(WIDTH, HEIGHT, [0.05; 2]).unwrap();
        let interior = InteriorOrientation { principal_point_mm: [0.0; 2], principal_distance_mm: 4.8 };
        Camera::new(format, interior, LensDistortion::default()).unwrap()
    }

    /// Range of a plane `n·p = -distance` along a ray.
    fn range(normal: &Vector3<f64>, distance: f64, ray: &Vector3<f64>) -> f64 {
        -distance / normal.dot(ray)
    }

    fn frame(sigma: f32) -> RangeFrame {
        let raster = |value: f32| Raster::filled(WIDTH, HEIGHT, value);
        RangeFrame {
            range: raster(1.0),
            sigma: raster(sigma),
            amplitude: raster(1.0),
            flags: Raster::filled(WIDTH, HEIGHT, Flags::empty()),
        }
    }

    #[test]
    fn a_slanted_pixel_is_as_much_too_short_as_its_rays_say() {
        let (camera, normal) = (camera(), Vector3::new(0.1, 0.95, 0.3).normalize());
        let (col, row) = (20, 6);
        let surfaced = Surfaced { camera: &camera, frame: &frame(0.005), points: &[] };
        let surface = LocalPlane { normal, range: 1.0 };
        let Footprint { part, spread, .. } = surfaced.footprint(row * WIDTH + col, Some(surface)).unwrap();
        let (mut sum, mut squares, mut light) = (0.0, 0.0, 0.0);
        for index in 0..3600 {
            let place = [index % 60, index / 60].map(|k| (f64::from(k) + 0.5) / 60.0 - 0.5);
            let ray = camera.ray([col as f64 + place[0], row as f64 + place[1]]);
            let range_m = range(&normal, 1.4, &ray);
            let returned = normal.dot(&ray).abs() / range_m.powi(2);
            sum += returned * range_m;
            squares += returned * range_m * range_m;
            light += returned;
        }
        let centre = range(&normal, 1.4, &camera.ray([col as f64, row as f64]));
        let expected = sum / light / centre - 1.0;
        // Fourth orders of a pixel's width: a part of (q'/q)², which is below a hundredth here.
        assert!(expected < -1e-4 && (part / expected - 1.0).abs() < 0.02, "{part} {expected}");
        let scatter = (squares / light - (sum / light).powi(2)).sqrt() / centre;
        assert!(scatter > 1e-3 && (spread / scatter - 1.0).abs() < 0.02, "{spread} {scatter}");
    }

    #[test]
    fn what_a_grazing_floor_does_is_known_through_noise() {
        // A floor 1.4 m away, seen from 3 m under 63 degrees to 8 m under 80 degrees, ranges with 10 mm of noise: where the range of
        // neighbours differs by more than a part of it, no pixel may go without its slant.
        let (camera, normal, sigma_m) = (camera(), Vector3::new(0.0, 0.95, 0.3).normalize(), 0.01);
        let frame = frame(sigma_m as f32);
        let mut random = rand_pcg::Pcg64::seed_from_u64(3);
        let (mut exact, mut points) = (Vec::new(), Vec::new());
        for index in 0..WIDTH * HEIGHT {
            let ray = camera.ray([(index % WIDTH) as f64, (index / WIDTH) as f64]);
            let range_m = Some(range(&normal, 1.4, &ray)).filter(|range_m| (0.0..8.0).contains(range_m));
            let noise: f64 = random.sample(StandardNormal);
            let point = |range_m: f64| (ray * (range_m + sigma_m * noise)).into();
            points.push(range_m.map_or([f64::NAN; 3], point));
            exact.push(range_m);
        }
        let surfaced = Surfaced { camera: &camera, frame: &frame, points: &points };
        let found = surfaced.footprints();
        let on_floor = (0..found.len()).filter(|&index| exact[index].is_some());
        let surface = LocalPlane { normal, range: 1.0 };
        let both = |index: usize| Some([found[index]?.part, surfaced.footprint(index, Some(surface))?.part]);
        let parts: Vec<[f64; 2]> = on_floor.filter_map(both).collect();
        let [sum, expected] = [0, 1].map(|k| parts.iter().map(|part| part[k]).sum::<f64>());
        assert!(parts.len() > 300 && (sum / expected - 1.0).abs() < 0.02, "{}: {sum}, {expected}", parts.len());
        assert!(parts.iter().all(|[part, exact]| (part / exact - 1.0).abs() < 0.5));
        // The surface about a pixel has a range of less noise than its own.
        let squares = |smooth: bool| {
            let off = |index: usize| {
                let own = Vector3::from(points[index]).norm();
                Some(own * if smooth { found[index]?.range } else { 1.0 } - exact[index]?)
            };
            let all: Vec<f64> = (0..found.len()).filter_map(off).map(|off| off * off).collect();
            (all.iter().sum::<f64>() / all.len() as f64).sqrt()
        };
        let [own, surface] = [squares(false), squares(true)];
        assert!((own / sigma_m - 1.0).abs() < 0.1 && surface < 0.4 * own, "{own} {surface}");
    }

    #[test]
    fn pixels_on_a_crease_or_a_jump_are_at_an_edge_and_others_are_not() {
        let camera = camera();
        // Two walls that meet in the middle column, and a box before the right one from column 30 on.
        let walls = [Vector3::new(0.7, 0.0, 0.7), Vector3::new(-0.7, 0.0, 0.7)].map(|normal| normal.normalize());
        let mut points = Vec::new();
        for index in 0..WIDTH * HEIGHT {
            let ray = camera.ray([(index % WIDTH) as f64, (index / WIDTH) as f64]);
            let range_m = walls.iter().map(|wall| range(wall, 2.0, &ray)).fold(f64::INFINITY, f64::min);
            points.push((ray * if index % WIDTH < 30 { range_m } else { 1.5 / -ray.z }).into());
        }
        let seen = |sigma: f32| Surfaced { camera: &camera, frame: &frame(sigma), points: &points }.footprints();
        let columns = |found: &[Option<Footprint>]| -> Vec<usize> {
            (0..WIDTH).filter(|col| found[15 * WIDTH + col].is_none()).collect()
        };
        let found = columns(&seen(0.004));
        assert!(found.contains(&20) && found.contains(&29) && found.contains(&30), "{found:?}");
        assert!(
            found.len() <= 5 && found.iter().all(|col| (19..22).contains(col) || (29..31).contains(col)),
            "{found:?}"
        );
    }
}
