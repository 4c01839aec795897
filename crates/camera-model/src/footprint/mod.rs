//! What the width of a pixel does to its range.
//!
//! A pixel sees a patch of the scene, not a point. On a slanted surface the near part of the patch returns more light, so that the
//! range is shorter than along the pixel's ray: by a millimetre on a floor that is seen at 5 m under 70° by pixels of 0.7°. In a
//! simulated room, stations came out 0.14 mm too low of it at a stated 0.2 mm; with one ray a pixel they did not. In a calibration, such
//! pixels are dark as well as far, and terms of the amplitude and of the range take the place of what they have in common: the value in
//! the dark came out 1 mm too small, and the squared errors of all terms were 2.0 times their variances; with one ray a pixel, 0.9
//! times. Where a pixel's patch goes over an edge, its range lies between two surfaces, and it tells nothing of either.
//!
//! With `q = n·e` for a surface's normal n and rays e, ranges are `D/q`, and light from beside the lens on a dull surface comes back as
//! `q/ρ² ~ q³`. The mean over a pixel of width one is `1 − Σ (2 (q'/q)² + q''/(2q)) / 12` times the range at its centre, summed over
//! columns and rows.

mod edges;
mod local_planes;

use nalgebra::Vector3;
use range_image::Flags;
use rayon::prelude::*;

use crate::{OrganisedCloud, RayTable, Result};
use edges::Edges;
use local_planes::{ColumnSums, LocalPlane, LocalPlanes};

/// Variance of a place drawn from all of a pixel, pixel widths squared.
const PIXEL_VARIANCE: f64 = 1.0 / 12.0;
/// Largest part of a range that a footprint changes: beyond, the surface is seen edge-on, and its normal does not tell.
const LARGEST: f64 = 3e-3;
/// Angle of a pixel below which its width is left in the ranges, radian: on a surface seen under 80° it does 3e-5 of the range, 0.09 mm
/// at 3 m, and a tenth of that under 60°; noise is a hundred times as much, and a frame of 640x480 takes 65 ms of processor time. With
/// half the angle, cameras of 640x480 are corrected as well.
const NARROW: f64 = 2.4e-3;
/// Standard deviation of a range of which none is stated, metre: their scale is found.
const UNKNOWN_M: f64 = 0.01;

/// What a pixel sees of the surface about it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Footprint {
    /// Range of the surface along the pixel's ray over the pixel's own, both as measured: nearly without its noise. One where no
    /// surface is found.
    pub range: f64,
    /// Part of the range by which the pixel's width changes it; zero where no surface is found.
    pub part: f64,
    /// Standard deviation of the ranges that the pixel sees, part of the range.
    pub spread: f64,
}

impl RayTable {
    /// What each pixel of a frame sees, from its points and their standard deviations; pixels without a point (NaN) and with one of
    /// the flags `exclude` take no part. `None` for these, where the surface is seen edge-on, and where the pixel's patch may go over
    /// an edge.
    ///
    /// Fails where the cloud does not fit the table.
    pub fn footprints(&self, cloud: &OrganisedCloud, exclude: Flags) -> Result<Vec<Option<Footprint>>> {
        self.require(cloud.width, cloud.height, "cloud")?;
        // Its planes are public: each may have any length.
        for length in [cloud.points.len(), cloud.sigma.len(), cloud.flags.len()] {
            if length != cloud.width * cloud.height {
                self.require(length, 1, "plane of a cloud")?;
            }
        }
        let seen: Vec<Seen> = (0..cloud.points.len())
            .into_par_iter()
            .map(|index| Seen::new(self.directions()[index], cloud, index, exclude))
            .collect();
        let edges = Edges::new(&seen, cloud);
        let planes = LocalPlanes::new(&seen, cloud.width, edges.scale());
        let mut footprints = vec![None; seen.len()];
        footprints.par_chunks_mut(cloud.width).enumerate().for_each_init(
            || ColumnSums::new(cloud.width),
            |sums, (row, footprints)| {
                planes.sum(row, sums);
                for (col, footprint) in footprints.iter_mut().enumerate() {
                    let index = row * cloud.width + col;
                    if seen[index].is_known() && !edges.is_at_edge(col, row) {
                        *footprint = self.footprint(col, row, planes.about(index, sums));
                    }
                }
            },
        );
        Ok(footprints)
    }

    /// Takes what the width of pixels does to their ranges off the points of a frame: those on slanted surfaces move along their
    /// rays. Those that carry a flag, or of whose surface too little is known, stay as they are; so do all of a camera whose pixels
    /// are narrower than 2.4 mrad, where it is less than 0.1 mm at 3 m under 80°.
    ///
    /// Fails where the cloud does not fit the table.
    pub fn take_off_pixel_width(&self, cloud: &mut OrganisedCloud) -> Result<()> {
        if self.widest_pixel() < NARROW {
            return self.require(cloud.width, cloud.height, "cloud");
        }
        let footprints = self.footprints(cloud, Flags::all())?;
        for (point, footprint) in cloud.points.iter_mut().zip(footprints) {
            if let Some(footprint) = footprint {
                *point = point.map(|coordinate| coordinate / (1.0 + footprint.part));
            }
        }
        Ok(())
    }

    /// Largest angle between the rays of pixels side by side, radian.
    fn widest_pixel(&self) -> f64 {
        let (rays, width) = (self.directions(), self.format().width);
        let along_rows = rays.chunks_exact(width).flat_map(|row| row.iter().zip(&row[1..]));
        let pairs = along_rows.chain(rays.iter().zip(&rays[width..]));
        pairs.map(|(a, b)| (Vector3::from(*a) - Vector3::from(*b)).norm_squared()).fold(0.0, f64::max).sqrt()
    }

    /// What a pixel sees of the surface about it; `None` where it is seen edge-on.
    fn footprint(&self, col: usize, row: usize, surface: Option<LocalPlane>) -> Option<Footprint> {
        let (width, height) = (self.format().width, self.format().height);
        // A few pixels on narrow things; they tell where the camera stands.
        let Some(LocalPlane { normal, range }) = surface.filter(|_| width.min(height) > 2) else {
            return Some(Footprint { range: 1.0, part: 0.0, spread: 0.0 });
        };
        let cosine = |col: usize, row: usize| normal.dot(&Vector3::from(self.directions()[row * width + col]));
        // Slope and bend of the cosine over itself; at the border those of the pixel beside it.
        let change = |at: usize, end: usize, cosine: &dyn Fn(usize) -> f64| {
            let middle = at.clamp(1, end - 2);
            let [before, centre, after] = [middle - 1, middle, middle + 1].map(cosine);
            [(after - before) / 2.0 / centre, f64::midpoint(before, after) / centre - 1.0]
        };
        let [by_col, bent_by_col] = change(col, width, &|col| cosine(col, row));
        let [by_row, bent_by_row] = change(row, height, &|row| cosine(col, row));
        let slope = by_col * by_col + by_row * by_row;
        let part = -PIXEL_VARIANCE * (2.0 * slope + bent_by_col + bent_by_row);
        (part.abs() <= LARGEST).then(|| Footprint { range, part, spread: (PIXEL_VARIANCE * slope).sqrt() })
    }
}

/// A pixel as an observation of the surface that it sees: one over the depth of a plane is linear in the image.
#[derive(Clone, Copy)]
struct Seen {
    /// Direction of the ray at unit depth.
    direction: [f64; 2],
    /// One over the depth, 1/m; zero where it takes no part.
    inverse: f64,
    /// Standard deviation of the range, metre.
    sigma_m: f64,
    /// One over the variance of the inverse depth, square metre; zero where it takes no part.
    weight: f64,
}

impl Seen {
    fn new([x, y, z]: [f64; 3], cloud: &OrganisedCloud, index: usize, exclude: Flags) -> Self {
        let sigma = f64::from(cloud.sigma[index]);
        let sigma_m = if sigma > 0.0 && sigma.is_finite() { sigma } else { UNKNOWN_M };
        let inverse = -1.0 / cloud.points[index][2];
        // The noise of a range moves the inverse depth by the same part of it. The ray is one long.
        let weight = (cloud.points[index][2] / z / (inverse * sigma_m)).powi(2);
        let is_usable = weight.is_finite() && !cloud.flags[index].intersects(exclude);
        let [inverse, weight] = if is_usable { [inverse, weight] } else { [0.0; 2] };
        Self { direction: [-x / z, -y / z], inverse, sigma_m, weight }
    }

    /// Whether it takes part.
    fn is_known(&self) -> bool {
        self.weight > 0.0
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use nalgebra::Vector3;
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;

    use crate::{Camera, ImageFormat, InteriorOrientation, LensDistortion};

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

    /// A frame without flags.
    fn cloud(sigma: f32, points: Vec<[f64; 3]>) -> OrganisedCloud {
        let count = WIDTH * HEIGHT;
        let (amplitude, flags) = (vec![1.0; count], vec![Flags::empty(); count]);
        OrganisedCloud { width: WIDTH, height: HEIGHT, points, sigma: vec![sigma; count], amplitude, flags }
    }

    #[test]
    fn a_slanted_pixel_is_as_much_too_short_as_its_rays_say() {
        let (camera, normal) = (camera(), Vector3::new(0.1, 0.95, 0.3).normalize());
        let (col, row) = (20, 6);
        let rays = RayTable::new(&camera).unwrap();
        let surface = LocalPlane { normal, range: 1.0 };
        let Footprint { part, spread, .. } = rays.footprint(col, row, Some(surface)).unwrap();
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
        let (rays, cloud) = (RayTable::new(&camera).unwrap(), cloud(sigma_m as f32, points));
        let found = rays.footprints(&cloud, Flags::all()).unwrap();
        let on_floor = (0..found.len()).filter(|&index| exact[index].is_some());
        let surface = LocalPlane { normal, range: 1.0 };
        let both = |index: usize| {
            Some([found[index]?.part, rays.footprint(index % WIDTH, index / WIDTH, Some(surface))?.part])
        };
        let parts: Vec<[f64; 2]> = on_floor.filter_map(both).collect();
        let [sum, expected] = [0, 1].map(|k| parts.iter().map(|part| part[k]).sum::<f64>());
        assert!(parts.len() > 300 && (sum / expected - 1.0).abs() < 0.02, "{}: {sum}, {expected}", parts.len());
        assert!(parts.iter().all(|[part, exact]| (part / exact - 1.0).abs() < 0.5));
        // The surface about a pixel has a range of less noise than its own.
        let squares = |smooth: bool| {
            let off = |index: usize| {
                let own = Vector3::from(cloud.points[index]).norm();
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
        let columns = |found: &[Option<Footprint>]| -> Vec<usize> {
            (0..WIDTH).filter(|col| found[15 * WIDTH + col].is_none()).collect()
        };
        let found = columns(&RayTable::new(&camera).unwrap().footprints(&cloud(0.004, points), Flags::all()).unwrap());
        assert!(found.contains(&20) && found.contains(&29) && found.contains(&30), "{found:?}");
        assert!(
            found.len() <= 5 && found.iter().all(|col| (19..22).contains(col) || (29..31).contains(col)),
            "{found:?}"
        );
    }
}
