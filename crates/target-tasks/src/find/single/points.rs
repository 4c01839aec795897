//! Single targets as they are measured, before they have names.

use camera_model::Camera;
use nalgebra::{Matrix2, Matrix2x3, Vector2, Vector3};
use range_image::{Flags, RangeFrame};
use statistics::{Distribution, robust_standard_deviation};
use targets::{
    CircleOptions, CircleSighting, CodedOptions, CodedSighting, LightOptions, SphereOptions, SphereSighting,
    centre_of_circle, find_circles, find_coded, find_lights, find_spheres, poses_of_circle, target_range,
};

use crate::find::pictures::Picture;
use crate::kind::SingleKind;

/// Surroundings that a range is taken from, in radii of the disc: the disc with as much of its ground, and all of a coded ring.
const DISC_SURROUNDINGS: f64 = 2.0;
const RING_SURROUNDINGS: f64 = 3.0;
/// Pixels that the surroundings reach to at least: 37 of them tell a plane.
const LEAST_RADIUS_PX: f64 = 3.5;
/// Part by which the distance of a ring by its size and its range may differ: a nominal principal distance and ranges that are not
/// corrected are a few percent off, another interval is half the range or more.
const SIZE_AGREES: f64 = 0.25;
/// Level of the test that decides between the two planes in which a circle can lie.
const LEVEL: f64 = 0.01;
/// A median of absolute values has the variance of a mean of so many parts of the values.
const EFFICIENCY: f64 = 0.37;

/// A target that was measured.
#[derive(Debug, Clone)]
pub(crate) struct Point {
    /// The name of its code, if it has one.
    pub(crate) code: Option<String>,
    pub(crate) pixel: [f64; 2],
    pub(crate) sigma_px: [f64; 2],
    /// Range and standard deviation, metre.
    pub(crate) range: Option<[f64; 2]>,
    pub(crate) amplitude: Option<f64>,
    /// Why it takes no part.
    pub(crate) fault: Option<String>,
}

/// All targets of a kind in a picture.
pub(crate) fn points(kind: SingleKind, picture: &Picture, camera: &Camera) -> Result<Vec<Point>, targets::Error> {
    let measure = Measure { picture, camera };
    match kind {
        SingleKind::Rings { diameter_m } => {
            let found = find_coded(&picture.light, &CodedOptions::default())?;
            Ok(found.iter().map(|ring| measure.ring(ring, 0.5 * diameter_m)).collect())
        }
        SingleKind::Discs => {
            let found = find_circles(&picture.light, &CircleOptions::default())?;
            Ok(found.iter().map(|disc| measure.disc(disc, DISC_SURROUNDINGS)).collect())
        }
        SingleKind::Spheres { radius_m } => {
            let Some((frame, _)) = &picture.ranges else { return Ok(Vec::new()) };
            let found = find_spheres(frame, camera, &SphereOptions { radius_m, ..SphereOptions::default() })?;
            Ok(found.iter().filter_map(|sphere| measure.sphere(sphere, frame)).collect())
        }
        SingleKind::Lights => {
            let found = find_lights(&picture.light, &LightOptions::default())?;
            let point = |light: &targets::LightSighting| {
                measure.point(light.centre.pixel, &light.centre.covariance, LEAST_RADIUS_PX)
            };
            Ok(found.iter().map(point).collect())
        }
    }
}

struct Measure<'a> {
    picture: &'a Picture,
    camera: &'a Camera,
}

impl Measure<'_> {
    fn frame(&self) -> Option<&RangeFrame> {
        self.picture.ranges.as_ref().map(|(frame, _)| frame)
    }

    /// An image point with the range of what lies about it.
    fn point(&self, pixel: [f64; 2], covariance: &Matrix2<f64>, radius_px: f64) -> Point {
        let range = self.frame().and_then(|frame| {
            let range = target_range(frame, self.camera, pixel, radius_px.max(LEAST_RADIUS_PX)).ok()?;
            (range.sigma_m > 0.0).then_some(range)
        });
        Point {
            code: None,
            pixel,
            sigma_px: [0, 1].map(|axis| covariance[(axis, axis)].sqrt()),
            range: range.map(|range| [range.range_m, range.sigma_m]),
            amplitude: range.map(|range| range.amplitude).filter(|amplitude| amplitude.is_finite()),
            fault: None,
        }
    }

    fn disc(&self, disc: &CircleSighting, surroundings: f64) -> Point {
        let (pixel, covariance) = self.circle_centre(disc);
        let point = self.point(pixel, &covariance, surroundings * disc.ellipse.mean_radius_px());
        let fault = disc.saturated.then(|| "it is saturated: take it with less light".to_owned());
        Point { fault, ..point }
    }

    fn ring(&self, ring: &CodedSighting, radius_m: f64) -> Point {
        let point = self.disc(&ring.circle, RING_SURROUNDINGS);
        let by_size = poses_of_circle(self.camera, &ring.circle.ellipse, radius_m).ok();
        let by_size = by_size.map(|[pose, _]| pose.centre.coords.norm());
        let contradicts =
            point.range.zip(by_size).filter(|([range, _], size)| (range / size - 1.0).abs() > SIZE_AGREES);
        let fault = match contradicts {
            _ if ring.is_repeated => Some("its code is seen twice, and nothing tells which is which".to_owned()),
            Some(([range, _], size)) => Some(format!(
                "it is {size:.2} m away by its size and {range:.2} m by its range: it is no ring of this diameter, or the range is \
                 that of something else"
            )),
            None => point.fault.clone(),
        };
        Point { code: Some(ring.code.to_string()), fault, ..point }
    }

    /// The image of the circle's centre. An ellipse has two planes in which it is a circle: the ranges about it decide, or else
    /// the middle is taken, with what that may be off in the covariance.
    fn circle_centre(&self, disc: &CircleSighting) -> ([f64; 2], Matrix2<f64>) {
        let ellipse = (disc.centre.pixel, disc.centre.covariance);
        // The planes do not depend on the radius.
        let Ok(poses) = poses_of_circle(self.camera, &disc.ellipse, 1.0) else { return ellipse };
        let normals = poses.map(|pose| pose.normal);
        let centres = normals.map(|normal| centre_of_circle(self.camera, &disc.ellipse, &normal).ok());
        let [Some(first), Some(second)] = centres.map(|centre| centre.map(|centre| Vector2::from(centre.pixel))) else {
            return ellipse;
        };
        match self.plane_by_ranges(disc, &normals) {
            Some(0) => (first.into(), ellipse.1),
            Some(_) => (second.into(), ellipse.1),
            None => {
                let half = (first - second) * 0.5;
                ((second + half).into(), ellipse.1 + half * half.transpose())
            }
        }
    }

    /// Which of two planes the ranges about a disc lie on, if they tell.
    fn plane_by_ranges(&self, disc: &CircleSighting, normals: &[Vector3<f64>; 2]) -> Option<usize> {
        let frame = self.frame()?;
        let [col, row] = disc.ellipse.centre;
        let reach = DISC_SURROUNDINGS * disc.ellipse.semi_axes_px[0];
        let span = |middle: f64, size: usize| {
            (middle - reach).max(0.0).ceil() as usize..((middle + reach).max(-1.0) + 1.0).min(size as f64) as usize
        };
        let (mut distances, mut count) = ([Vec::new(), Vec::new()], 0_usize);
        for y in span(row, frame.height()) {
            for x in span(col, frame.width()) {
                let range = f64::from(frame.range[(x, y)]);
                let useless = frame.flags[(x, y)].intersects(Flags::NO_DATA | Flags::SATURATED);
                if !useless && range > 0.0 && (x as f64 - col).hypot(y as f64 - row) <= reach {
                    let ray = self.camera.ray([x as f64, y as f64]);
                    for (own, normal) in distances.iter_mut().zip(normals) {
                        own.push(range * ray.dot(normal));
                    }
                    count += 1;
                }
            }
        }
        let [first, second] = distances.map(|own| robust_standard_deviation(&own).powi(2));
        let dof = EFFICIENCY * count as f64;
        let (ratio, chosen) = if first < second { (second / first, 0) } else { (first / second, 1) };
        let test = Distribution::Fisher { numerator: dof, denominator: dof };
        (count >= 12 && test.survival(ratio) < 0.5 * LEVEL).then_some(chosen)
    }

    /// The image point and the range of a sphere's centre.
    fn sphere(&self, sphere: &SphereSighting, frame: &RangeFrame) -> Option<Point> {
        let pixel = self.camera.project(&sphere.centre).ok()?;
        let range = sphere.centre.coords.norm();
        let step = 1e-4 * range;
        let mut by_centre = Matrix2x3::zeros();
        for axis in 0..3 {
            let moved = |sign: f64| {
                let mut centre = sphere.centre;
                centre[axis] += sign * step;
                self.camera.project(&centre).ok().map(Vector2::from)
            };
            by_centre.set_column(axis, &((moved(1.0)? - moved(-1.0)?) / (2.0 * step)));
        }
        // Stated by the sigmas of the ranges, which may be too small.
        let covariance = sphere.covariance * sphere.sigma0.max(1.0).powi(2);
        let in_image = by_centre * covariance * by_centre.transpose();
        let ray = sphere.centre.coords / range;
        let sigma = (ray.transpose() * covariance * ray)[0].sqrt();
        let [col, row] = pixel.map(|value| value.round().max(0.0) as usize);
        let amplitude = frame.amplitude.get(col, row).map(|amplitude| f64::from(*amplitude));
        Some(Point {
            code: None,
            pixel,
            sigma_px: [0, 1].map(|axis| in_image[(axis, axis)].sqrt()),
            range: Some([range, sigma]),
            amplitude: amplitude.filter(|amplitude| amplitude.is_finite()),
            fault: None,
        })
    }
}
