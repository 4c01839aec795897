use camera_model::{Camera, RayTable};
use nalgebra::{Matrix3, Point3, Vector3};
use primitives::{DifferenceOptions, Primitive, PrimitiveFit, PrimitiveKind, PrimitiveOptions, fit_primitive};
use range_image::{Flags, RangeFrame, Raster};

use super::candidates::{Candidate, Points, candidates};
use super::options::SphereOptions;
use crate::error::Result;

/// Largest angle of incidence of a pixel that takes part: mixed pixels begin at the limb, a pixel of a sphere ten pixels across
/// reaches from there to 55°, and the mean over a pixel's field of view lies behind its middle by half a millimetre at 50°, by
/// two at 60° (radius 0.1 m, pixels of 15 mm).
const LARGEST_INCIDENCE_DEG: f64 = 50.0;
/// Pixels nearer to a candidate than this part of its radius may be its own.
const NEAR_PARTS: f64 = 0.25;
/// Standard deviations within which a pixel lies on the sphere, and a radius agrees with the one given (with a part of it for what
/// is not random: scattered light, errors of the ranges).
const AGREE_SIGMAS: f64 = 4.0;
const AGREE_PARTS: f64 = 0.03;
/// The same at most in parts of the radius: what is less round than that is no sphere, whatever the noise allows.
const ROUND_PARTS: f64 = 0.15;
/// Rounds of choosing pixels by the sphere found last.
const ROUNDS: usize = 3;
/// Pixels beside the outline, in parts of the radius, of which most must lie behind the limb: a sphere ends there.
const BESIDE_PARTS: [f64; 2] = [1.15, 1.5];
const LEAST_BEHIND: f64 = 0.6;

/// A sphere that was seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SphereSighting {
    /// Centre, camera frame, metre.
    pub centre: Point3<f64>,
    /// Covariance of the centre, square metre, from the sigmas of the ranges.
    pub covariance: Matrix3<f64>,
    /// Radius, metre: the one given, or the one found.
    pub radius_m: f64,
    /// Standard deviation of the radius that the ranges give, metre, also where another was given.
    pub radius_sigma_m: f64,
    /// Standard deviation of unit weight: 1 if the pixels scatter as their sigmas say.
    pub sigma0: f64,
    /// Pixels that took part.
    pub pixels: usize,
}

/// Finds spheres in a range image: their centres and, where it is not given, their radius.
///
/// Candidates are spheres through round windows; each is fitted along the rays ([`primitives::fit_primitive`]) to the pixels inside
/// its outline, those at the limb left out. Kept is what fills its outline and ends there. A radius that is given goes into the
/// estimate as an observation without error. The sightings come by the row, then the column of their centres.
///
/// # Errors
/// [`crate::Error::Invalid`] for options that cannot be met, [`crate::Error::Raster`] where frame and camera differ in size,
/// [`crate::Error::Camera`].
///
/// ```
/// use targets::camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion};
/// use targets::nalgebra::Vector3;
/// use targets::range_image::{RangeFrame, Raster};
/// use targets::{SphereOptions, find_spheres};
///
/// let format = ImageFormat::new(176, 144, [0.04, 0.04])?;
/// let interior = InteriorOrientation { principal_point_mm: [0.0, 0.0], principal_distance_mm: 8.0 };
/// let camera = Camera::new(format, interior, LensDistortion::default())?;
/// // A sphere of 0.1 m, 2 m away, before a wall.
/// let centre = Vector3::new(0.1, 0.05, -2.0);
/// let range = Raster::from_fn(176, 144, |col, row| {
///     let ray = camera.ray([col as f64, row as f64]);
///     let (along, gap) = (ray.dot(&centre), 0.01 - centre.norm_squared());
///     let root = along * along + gap;
///     (if root > 0.0 { along - root.sqrt() } else { -3.0 / ray.z }) as f32
/// });
/// let frame = RangeFrame { sigma: Raster::filled(176, 144, 0.005), ..RangeFrame::from_range(range) };
/// let options = SphereOptions { radius_m: Some(0.1), ..SphereOptions::default() };
/// let found = find_spheres(&frame, &camera, &options)?;
/// assert!(found.len() == 1 && (found[0].centre.coords - centre).norm() < 1e-4);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn find_spheres(frame: &RangeFrame, camera: &Camera, options: &SphereOptions) -> Result<Vec<SphereSighting>> {
    options.validate()?;
    camera.validate()?;
    frame.validate()?;
    let rays = RayTable::new(camera)?;
    let (width, height) = (camera.format.width, camera.format.height);
    frame.range.require_same_size(&Raster::filled(width, height, ()), "camera")?;
    let scene = Scene::new(frame, camera, &rays, options);
    let frame = Points { raster: &scene.points, sigmas_m: &scene.sigmas_m, pixel_rad: scene.pixel_rad };
    let mut found: Vec<SphereSighting> = Vec::new();
    for candidate in candidates(&frame, options) {
        let inside = |other: &SphereSighting| (other.centre - candidate.centre).norm() < 0.7 * other.radius_m;
        if !found.iter().any(inside) {
            let sighting = scene.sighting(&candidate);
            found
                .extend(sighting.filter(|own| {
                    found.iter().all(|other| (other.centre - own.centre).norm() >= 0.7 * other.radius_m)
                }));
        }
    }
    let direction = |sphere: &SphereSighting| {
        let [x, y] = [sphere.centre.x, sphere.centre.y].map(|value| value / -sphere.centre.z);
        [-y, x]
    };
    found.sort_by(|a, b| {
        let (a, b) = (direction(a), direction(b));
        a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1]))
    });
    Ok(found)
}

/// A frame with its points.
struct Scene<'a> {
    frame: &'a RangeFrame,
    camera: &'a Camera,
    rays: &'a RayTable,
    options: &'a SphereOptions,
    /// NaN where there is no usable range.
    points: Raster<Vector3<f64>>,
    sigmas_m: Raster<f64>,
    pixel_rad: f64,
}

impl<'a> Scene<'a> {
    fn new(frame: &'a RangeFrame, camera: &'a Camera, rays: &'a RayTable, options: &'a SphereOptions) -> Self {
        let exclude = DifferenceOptions::default().exclude;
        let (width, height) = (frame.width(), frame.height());
        let points = Raster::from_fn(width, height, |col, row| {
            let range = f64::from(frame.range[(col, row)]);
            let usable = range > 0.0 && range.is_finite() && !frame.flags[(col, row)].intersects(exclude);
            if usable { rays.direction(col, row) * range } else { Vector3::repeat(f64::NAN) }
        });
        let sigmas_m = frame.sigma.map(|sigma| {
            let sigma = f64::from(*sigma);
            if sigma > 0.0 && sigma.is_finite() { sigma } else { options.unknown_sigma_m }
        });
        let [x, y] = camera.format.pixel_pitch_mm;
        let pixel_rad = x.max(y) / camera.interior.principal_distance_mm;
        Self { frame, camera, rays, options, points, sigmas_m, pixel_rad }
    }

    fn sighting(&self, candidate: &Candidate) -> Option<SphereSighting> {
        let radius = self.options.radius_m.unwrap_or(candidate.radius_m);
        let mut sphere = (candidate.centre, radius);
        let mut last = None;
        for round in 0..ROUNDS {
            // The candidate is as uncertain as a part of its radius, the spheres after it are not.
            let near = if round == 0 { NEAR_PARTS * radius } else { 0.0 };
            let fit = self.fitted(sphere, near)?;
            let sighting = self.with_radius(&fit)?;
            sphere = (sighting.centre, sighting.radius_m);
            last = Some(sighting);
        }
        last.filter(|sighting| self.is_filled(sighting) && self.ends_at_outline(sighting))
    }

    /// The sphere fitted to the pixels about one that is nearly it.
    fn fitted(&self, (centre, radius): (Point3<f64>, f64), near_m: f64) -> Option<PrimitiveFit> {
        let window = self.window(&centre, radius)?;
        let [[first_col, last_col], [first_row, last_row]] = window;
        let least_cosine = LARGEST_INCIDENCE_DEG.to_radians().cos();
        let mut own = RangeFrame {
            range: Raster::filled(self.frame.width(), self.frame.height(), f32::NAN),
            sigma: self.frame.sigma.clone(),
            amplitude: self.frame.amplitude.clone(),
            flags: Raster::filled(self.frame.width(), self.frame.height(), Flags::empty()),
        };
        let mut count = 0;
        for row in first_row..=last_row {
            for col in first_col..=last_col {
                let Some((range, cosine)) = hit(&self.rays.direction(col, row), &centre, radius) else { continue };
                let limit = near_m.max(AGREE_SIGMAS * self.sigmas_m[(col, row)] + AGREE_PARTS * radius);
                if cosine >= least_cosine && (self.points[(col, row)].norm() - range).abs() <= limit {
                    own.range[(col, row)] = self.frame.range[(col, row)];
                    count += 1;
                }
            }
        }
        if count < self.options.least_pixels {
            return None;
        }
        let pixels = DifferenceOptions {
            window: Some(window),
            unknown_sigma_m: self.options.unknown_sigma_m,
            largest_incidence_rad: 75_f64.to_radians(),
            ..DifferenceOptions::default()
        };
        let options = PrimitiveOptions { pixels, seed: self.options.seed, ..PrimitiveOptions::default() };
        fit_primitive(&own, self.camera, PrimitiveKind::Sphere, &options).ok()
    }

    /// The sighting of a fit: a given radius as an observation without error, `x − C_xr / C_rr (r̂ − r)`.
    fn with_radius(&self, fit: &PrimitiveFit) -> Option<SphereSighting> {
        let Primitive::Sphere { centre, radius_m } = fit.primitive else { return None };
        let covariance: Matrix3<f64> = fit.covariance.fixed_view::<3, 3>(0, 0).into_owned();
        let variance = fit.covariance[(3, 3)];
        let sighting = SphereSighting {
            centre,
            covariance,
            radius_m,
            radius_sigma_m: variance.sqrt(),
            sigma0: fit.sigma0,
            pixels: fit.pixels.iter().filter(|pixel| pixel.used).count(),
        };
        let Some(given) = self.options.radius_m else {
            let [small, large] = self.options.radii_m;
            return (small..=large).contains(&radius_m).then_some(sighting);
        };
        let off = radius_m - given;
        let limit = AGREE_SIGMAS * variance.sqrt() * fit.sigma0.max(1.0) + AGREE_PARTS * given;
        let by_radius: Vector3<f64> = fit.covariance.fixed_view::<3, 1>(0, 3).into_owned();
        (off.abs() <= limit).then(|| SphereSighting {
            centre: centre - by_radius * (off / variance),
            covariance: covariance - by_radius * by_radius.transpose() / variance,
            radius_m: given,
            ..sighting
        })
    }

    /// Whether most pixels inside the outline lie on the sphere.
    fn is_filled(&self, sphere: &SphereSighting) -> bool {
        let Some([columns, rows]) = self.window(&sphere.centre, sphere.radius_m) else { return false };
        let least_cosine = LARGEST_INCIDENCE_DEG.to_radians().cos();
        let (mut inside, mut on) = (0_usize, 0_usize);
        for row in rows[0]..=rows[1] {
            for col in columns[0]..=columns[1] {
                let hit = hit(&self.rays.direction(col, row), &sphere.centre, sphere.radius_m);
                let Some((range, _)) = hit.filter(|(_, cosine)| *cosine >= least_cosine) else { continue };
                let noise = AGREE_SIGMAS * self.sigmas_m[(col, row)] * sphere.sigma0.clamp(1.0, 2.0);
                let limit = noise.min(ROUND_PARTS * sphere.radius_m);
                inside += 1;
                on += usize::from((self.points[(col, row)].norm() - range).abs() <= limit);
            }
        }
        on >= self.options.least_pixels && on as f64 >= self.options.least_share * inside as f64
    }

    /// Whether most pixels beside the outline lie behind the limb, or have no range.
    fn ends_at_outline(&self, sphere: &SphereSighting) -> bool {
        let [near, far] = BESIDE_PARTS.map(|parts| parts * sphere.radius_m);
        let Some([columns, rows]) = self.window(&sphere.centre, far) else { return false };
        let limb = (sphere.centre.coords.norm_squared() - sphere.radius_m.powi(2)).max(0.0).sqrt();
        let (mut beside, mut behind) = (0_usize, 0_usize);
        for row in rows[0]..=rows[1] {
            for col in columns[0]..=columns[1] {
                let off = self.rays.direction(col, row).cross(&sphere.centre.coords).norm();
                if (near..=far).contains(&off) {
                    let range = self.points[(col, row)].norm();
                    beside += 1;
                    behind += usize::from(range.is_nan() || range >= limb);
                }
            }
        }
        behind as f64 >= LEAST_BEHIND * beside as f64
    }

    /// First and last column, first and last row of the outline, one pixel more; `None` outside the image.
    fn window(&self, centre: &Point3<f64>, radius: f64) -> Option<[[usize; 2]; 2]> {
        let pixel = self.camera.project(centre).ok()?;
        let sine = radius / centre.coords.norm();
        // Away from the middle of the image, rays spread and lenses bend: half as much again is enough.
        let reach = 1.0 + 1.5 * sine / (1.0 - sine * sine).max(0.01).sqrt() / self.pixel_rad;
        let range = |place: f64, size: usize| {
            let (first, last) = ((place - reach).max(0.0), (place + reach).min(size as f64 - 1.0));
            (first <= last).then_some([first as usize, last as usize])
        };
        Some([range(pixel[0], self.frame.width())?, range(pixel[1], self.frame.height())?])
    }
}

/// Range at which a ray meets a sphere, and the cosine of the angle of incidence.
fn hit(ray: &Vector3<f64>, centre: &Point3<f64>, radius: f64) -> Option<(f64, f64)> {
    let along = ray.dot(&centre.coords);
    let square = radius * radius - (centre.coords - ray * along).norm_squared();
    (square > 0.0 && along > square.sqrt()).then(|| (along - square.sqrt(), square.sqrt() / radius))
}
