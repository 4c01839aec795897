//! The range of a target: that of the plane around it, not that of one pixel.

use camera_model::Camera;
use nalgebra::{Matrix4, Vector3, Vector4};
use range_image::{Flags, RangeFrame};
use statistics::{SIGMA_OF_MAD, quantile};

use crate::{NotFound, Result};

/// Pixels below which a plane with its share of darkness, four unknowns, is not worth its covariance: twice as many.
const NEEDED: usize = 8;

/// Shares of the pixels, the nearest first, on which the plane is found step by step. The last is there twice: what the
/// first look at the outermost pixels left out is looked at again.
const GROWTH: [f64; 4] = [0.25, 0.5, 1.0, 1.0];

/// Square root of the pivot, of a matrix scaled to ones, below which the unknowns are not told apart: two neighbouring
/// columns of 20 pixels have 0.09, pixels in one line rounding.
const SMALLEST_PIVOT: f64 = 0.01;

/// Robust standard deviations from the plane beyond which a pixel is left out: of good ones one in two thousand.
const FAR: f64 = 3.5;

/// Spread of the darkness (10 to 90 %) from which on its influence is estimated: below, bright and dark parts are not
/// told apart, and the extrapolation to bright ones would cost more than it takes off. At 0.1 the influence that is left
/// is a tenth of what a surface of half the light would show.
const LEAST_DARKNESS: f64 = 0.1;

/// The share of the pixels' amplitudes below that of the bright surface.
const BRIGHT: f64 = 0.9;

/// The same for the dark surface. Pixels that see both lie on the line between the two, so that the choice does not matter
/// as long as it falls on the dark ones: discs of 0.3 spacings leave 0.5 of their surroundings to the ground.
const DARK: f64 = 0.1;

/// The range of a target with what it was read from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetRange {
    /// Distance of the target's plane from the perspective centre along the target's ray, as the camera shows it on the
    /// bright parts, metre.
    pub range_m: f64,
    /// Its standard deviation from the scatter of the pixels about the plane, metre.
    pub sigma_m: f64,
    /// Amplitude of the bright parts, in the camera's unit; NaN where the frame has none.
    pub amplitude: f64,
    /// The same as the camera shows it on the dark parts; `None` where the surroundings are of one brightness.
    pub dark: Option<DarkRange>,
    /// Pixels that it rests on.
    pub pixels: usize,
}

/// The range of a target as the camera shows it on the dark parts of its surroundings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DarkRange {
    /// As [`TargetRange::range_m`].
    pub range_m: f64,
    /// As [`TargetRange::sigma_m`].
    pub sigma_m: f64,
    /// Amplitude of the dark parts, in the camera's unit.
    pub amplitude: f64,
}

/// One pixel of the surroundings.
struct Sample {
    /// Distance from the target, pixel.
    distance: f64,
    row: Vector4<f64>,
    inverse_range: f64,
    weight: f64,
}

/// The range at a target's image point `pixel` (col, row), from the plane through the pixels within `radius_px` of it.
///
/// Along a plane the inverse range is linear in the direction of the ray. Dark parts show other ranges than bright ones
/// (Eq. 15, and light scattered from the bright ones onto them), and so do pixels that see both; either grows with the
/// inverse amplitude, which takes part as a fourth unknown where the surroundings have bright and dark parts. The range
/// is that of the bright ones, with that of the dark ones beside it. Pixels beyond 3.5 robust standard deviations, flagged without data or saturated, are left
/// out.
///
/// # Errors
/// [`NotFound::NoRange`] where fewer than eight pixels have a range, or they lie on a line.
///
/// ```
/// use targets::camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion};
/// use targets::range_image::{RangeFrame, Raster};
///
/// let interior = InteriorOrientation { principal_point_mm: [0.0, 0.0], principal_distance_mm: 8.0 };
/// let camera = Camera::new(ImageFormat::new(60, 48, [0.1, 0.1])?, interior, LensDistortion::default())?;
/// // A wall 3 m in front of the camera.
/// let range = Raster::from_fn(60, 48, |col, row| (-3.0 / camera.ray([col as f64, row as f64]).z) as f32);
/// let found = targets::target_range(&RangeFrame::from_range(range), &camera, [12.3, 30.8], 4.0)?;
/// let truth = -3.0 / camera.ray([12.3, 30.8]).z;
/// assert!((found.range_m - truth).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn target_range(frame: &RangeFrame, camera: &Camera, pixel: [f64; 2], radius_px: f64) -> Result<TargetRange> {
    let mut places = surroundings(frame, pixel, radius_px);
    let amplitude = |place: &[usize; 2]| f64::from(frame.amplitude[(place[0], place[1])]);
    let is_lit = |place: &[usize; 2]| amplitude(place) > 0.0 && amplitude(place).is_finite();
    let has_amplitudes = places.iter().any(is_lit);
    if has_amplitudes {
        places.retain(is_lit);
    }
    let [dark, bright] =
        [DARK, BRIGHT].map(|share| quantile(&mut places.iter().map(amplitude).collect::<Vec<_>>(), share));
    let ray = camera.ray(pixel);
    let axes = axes(&ray);
    let sample = |place: &[usize; 2]| {
        let [col, row] = *place;
        let direction = camera.ray([col as f64, row as f64]);
        let range = f64::from(frame.range[(col, row)]);
        let sigma = f64::from(frame.sigma[(col, row)]);
        let darkness = if has_amplitudes { bright / amplitude(place) - 1.0 } else { 0.0 };
        // The deviation of a range falls with the amplitude where nothing else is said of it.
        let sigma = match sigma {
            sigma if sigma > 0.0 && sigma.is_finite() => sigma,
            _ if has_amplitudes => bright / amplitude(place),
            _ => 1.0,
        };
        let [right, up] = axes.map(|axis| direction.dot(&axis));
        Sample {
            distance: (col as f64 - pixel[0]).hypot(row as f64 - pixel[1]),
            row: Vector4::new(direction.dot(&ray), right, up, darkness),
            inverse_range: range.recip(),
            weight: (range * range / sigma).powi(2),
        }
    };
    let samples: Vec<Sample> = places.iter().map(sample).collect();
    let no_range = || NotFound::NoRange { pixels: places.len(), needed: NEEDED };
    let plane = robust(samples).ok_or_else(no_range)?;
    let (range_m, sigma_m) = plane.range_at(0.0).ok_or_else(no_range)?;
    let on_dark = plane.tells_darkness.then(|| plane.range_at(bright / dark - 1.0)).flatten();
    Ok(TargetRange {
        range_m,
        sigma_m,
        amplitude: if has_amplitudes { bright } else { f64::NAN },
        dark: on_dark.map(|(range_m, sigma_m)| DarkRange { range_m, sigma_m, amplitude: dark }),
        pixels: plane.pixels,
    })
}

/// Two directions across a ray.
fn axes(ray: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let across = ray.cross(&Vector3::y()).try_normalize(f64::EPSILON).unwrap_or_else(Vector3::x);
    [across, across.cross(ray)]
}

fn surroundings(frame: &RangeFrame, [col, row]: [f64; 2], radius: f64) -> Vec<[usize; 2]> {
    let (width, height) = (frame.range.width(), frame.range.height());
    // Casts of what is below zero or no number give zero, and of what is too large the largest number.
    let span = |centre: f64, size: usize| {
        let (low, high) = ((centre - radius).ceil() as usize, (centre + radius).floor());
        if high < 0.0 { 0..0 } else { low.min(size)..(high as usize).saturating_add(1).min(size) }
    };
    let mut places = Vec::new();
    for y in span(row, height) {
        for x in span(col, width) {
            let inside = (x as f64 - col).hypot(y as f64 - row) <= radius;
            let range = frame.range[(x, y)];
            let useless = frame.flags[(x, y)].intersects(Flags::NO_DATA | Flags::SATURATED);
            if inside && !useless && range.is_finite() && range > 0.0 {
                places.push([x, y]);
            }
        }
    }
    places
}

/// Least squares over what lies on the plane; `None` where too little does. The plane grows from the target outwards, since
/// next to it nothing but the target is seen; what lies beside the target would tilt a plane through all.
fn robust(mut samples: Vec<Sample>) -> Option<Plane> {
    let darkness = || samples.iter().map(|sample| sample.row[3]).collect::<Vec<f64>>();
    let spread = quantile(&mut darkness(), 0.9) - quantile(&mut darkness(), 0.1);
    if spread.is_nan() || spread < LEAST_DARKNESS {
        for sample in &mut samples {
            sample.row[3] = 0.0;
        }
    }
    samples.sort_by(|a, b| a.distance.total_cmp(&b.distance));
    let all = samples.len();
    let mut plane = Plane::through(samples.iter().take((all / 4).max(2 * NEEDED)))?;
    for share in GROWTH {
        let reach = (all / 4).max(2 * NEEDED).max((share * all as f64) as usize);
        let mut sizes: Vec<f64> = plane.residuals(samples.iter().take(reach / 2)).collect();
        let scale = SIGMA_OF_MAD * quantile(&mut sizes, 0.5);
        plane = Plane::through(samples.iter().take(reach).filter(|sample| plane.holds(sample, scale)))?;
    }
    Some(plane)
}

/// Inverse range over the surroundings, by least squares.
struct Plane {
    unknowns: Vector4<f64>,
    cofactor: Matrix4<f64>,
    /// Of the unit of weight.
    variance: f64,
    pixels: usize,
    tells_darkness: bool,
}

impl Plane {
    /// `None` of too few samples, and of samples along a line.
    fn through<'a>(samples: impl Iterator<Item = &'a Sample> + Clone) -> Option<Self> {
        let pixels = samples.clone().count();
        let (mut normal, mut right) = (Matrix4::zeros(), Vector4::zeros());
        for sample in samples.clone() {
            normal += sample.weight * sample.row * sample.row.transpose();
            right += sample.weight * sample.inverse_range * sample.row;
        }
        let is_dark = normal[(3, 3)] > 0.0;
        if !is_dark {
            // Darkness takes no part.
            normal[(3, 3)] = 1.0;
        }
        // One scale for both directions across the ray: a small pivot means pixels along a line.
        let across = normal[(1, 1)].max(normal[(2, 2)]);
        let scale = Vector4::new(normal[(0, 0)], across, across, normal[(3, 3)]).map(|value| value.sqrt().recip());
        let scaled = normal.component_mul(&(scale * scale.transpose()));
        let factor = scaled.cholesky()?;
        if pixels < NEEDED || factor.l_dirty().diagonal().min() < SMALLEST_PIVOT {
            return None;
        }
        let unknowns = scale.component_mul(&factor.solve(&scale.component_mul(&right)));
        let cofactor = factor.inverse().component_mul(&(scale * scale.transpose()));
        let squares: f64 = samples.map(|sample| sample.residual(&unknowns).powi(2)).sum();
        let redundancy = pixels as f64 - if is_dark { 4.0 } else { 3.0 };
        Some(Self { unknowns, cofactor, variance: squares / redundancy, pixels, tells_darkness: is_dark })
    }

    /// Range along the target's ray and its standard deviation on a surface of this darkness; `None` behind the camera.
    fn range_at(&self, darkness: f64) -> Option<(f64, f64)> {
        let row = Vector4::new(1.0, 0.0, 0.0, darkness);
        let inverse_range = self.unknowns.dot(&row);
        let sigma = (self.variance * row.dot(&(self.cofactor * row))).sqrt() / (inverse_range * inverse_range);
        (inverse_range > 0.0 && sigma.is_finite()).then_some((inverse_range.recip(), sigma))
    }

    fn residuals<'a>(&self, samples: impl Iterator<Item = &'a Sample>) -> impl Iterator<Item = f64> {
        samples.map(|sample| sample.residual(&self.unknowns).abs())
    }

    /// Whether a sample lies on the plane, as far as the plane is known where it is.
    fn holds(&self, sample: &Sample, scale: f64) -> bool {
        let known = sample.weight * sample.row.dot(&(self.cofactor * sample.row));
        sample.residual(&self.unknowns).abs() <= FAR * scale * (1.0 + known).sqrt()
    }
}

impl Sample {
    /// In standard deviations, as far as they are known.
    fn residual(&self, unknowns: &Vector4<f64>) -> f64 {
        (self.inverse_range - self.row.dot(unknowns)) * self.weight.sqrt()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use camera_model::{ImageFormat, InteriorOrientation, LensDistortion};
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;
    use rand_pcg::Pcg64;
    use range_image::Raster;

    use super::*;

    fn camera() -> Camera {
        let interior = InteriorOrientation { principal_point_mm: [0.0, 0.0], principal_distance_mm: 8.0 };
        let lens = LensDistortion { k1: -1e-3, ..LensDistortion::default() };
        Camera::new(ImageFormat::new(60, 48, [0.1, 0.1]).unwrap(), interior, lens).unwrap()
    }

    const NORMAL: [f64; 3] = [0.3, -0.5, 0.8];

    fn plane_range(camera: &Camera, pixel: [f64; 2]) -> f64 {
        let normal = Vector3::from(NORMAL).normalize();
        -2.0 / camera.ray(pixel).dot(&normal)
    }

    fn is_bright(col: usize, row: usize) -> bool {
        (col / 4 + row / 4).is_multiple_of(2)
    }

    /// A tilted board of fields of four pixels; dark ones show `dark_m` more, and all scatter by sigma times bright over
    /// own amplitude.
    fn board(camera: &Camera, dark_m: f64, sigma: f64, rng: &mut Pcg64) -> RangeFrame {
        let mut frame = RangeFrame::from_range(Raster::filled(60, 48, 0.0));
        for row in 0..48 {
            for col in 0..60 {
                let (amplitude, offset) = if is_bright(col, row) { (200.0, 0.0) } else { (50.0, dark_m) };
                let noise: f64 = rng.sample(StandardNormal);
                let range = plane_range(camera, [col as f64, row as f64]) + offset + sigma * 200.0 / amplitude * noise;
                frame.range[(col, row)] = range as f32;
                frame.amplitude[(col, row)] = amplitude as f32;
            }
        }
        frame
    }

    #[test]
    fn ranges_of_bright_and_dark_parts_have_true_deviations() {
        let (camera, mut rng) = (camera(), Pcg64::seed_from_u64(4));
        let (mut squares, mut dark_squares, mut worst) = (0.0, 0.0, 0.0_f64);
        for run in 0..200 {
            let frame = board(&camera, 0.03, 0.004, &mut rng);
            let pixel = [20.0 + 0.1 * f64::from(run), 24.0];
            let found = target_range(&frame, &camera, pixel, 6.0).unwrap();
            let error = found.range_m - plane_range(&camera, pixel);
            squares += (error / found.sigma_m).powi(2) / 200.0;
            worst = worst.max(error.abs());
            assert!((found.amplitude - 200.0).abs() < 1e-9 && found.pixels > 80);
            let dark = found.dark.unwrap();
            let error = dark.range_m - plane_range(&camera, pixel) - 0.03;
            dark_squares += (error / dark.sigma_m).powi(2) / 200.0;
            assert!((dark.amplitude - 50.0).abs() < 1e-9 && dark.sigma_m > 2.0 * found.sigma_m);
        }
        // 200 squares of one degree scatter by a tenth; the few pixels of each fit make them 1.03 in the mean.
        assert!((0.8..1.25).contains(&squares) && worst < 0.006, "{squares} {worst}");
        assert!((0.8..1.25).contains(&dark_squares), "{dark_squares}");
    }

    #[test]
    fn what_lies_beside_the_board_does_not_take_part() {
        let (camera, mut rng) = (camera(), Pcg64::seed_from_u64(5));
        let mut frame = board(&camera, 0.0, 0.001, &mut rng);
        for row in 0..48 {
            for col in 34..60 {
                frame.range[(col, row)] += 0.5;
            }
        }
        let found = target_range(&frame, &camera, [30.0, 20.0], 6.0).unwrap();
        assert!((found.range_m - plane_range(&camera, [30.0, 20.0])).abs() < 4.0 * found.sigma_m, "{found:?}");
    }

    #[test]
    fn nothing_to_see_is_said() {
        let camera = camera();
        let mut frame = RangeFrame::from_range(Raster::filled(60, 48, f32::NAN));
        let few = |frame: &RangeFrame, pixel, radius| target_range(frame, &camera, pixel, radius).is_err();
        assert!(few(&frame, [30.0, 20.0], 5.0));
        for row in 0..48 {
            frame.range[(30, row)] = 2.0;
        }
        assert!(few(&frame, [30.0, 20.0], 20.0), "pixels in one column");
        frame = RangeFrame::from_range(Raster::filled(60, 48, 2.0));
        assert!(!few(&frame, [30.0, 20.0], 5.0));
        for (pixel, radius) in [([f64::NAN; 2], 5.0), ([30.0, 20.0], f64::NAN), ([1e9, -1e9], 5.0), ([30.0, 20.0], 0.0)]
        {
            assert!(few(&frame, pixel, radius), "{pixel:?} {radius}");
        }
        assert!(!few(&frame, [30.0, 20.0], f64::INFINITY), "all pixels");
    }

    #[test]
    fn axes_stand_across_the_ray() {
        for ray in [Vector3::y(), -Vector3::z(), Vector3::new(0.3, -0.4, -0.8).normalize()] {
            let [a, b] = axes(&ray);
            assert!(a.dot(&ray).abs() < 1e-12 && b.dot(&ray).abs() < 1e-12 && a.dot(&b).abs() < 1e-12);
            assert!((a.norm() - 1.0).abs() < 1e-12 && (b.norm() - 1.0).abs() < 1e-12);
        }
    }
}
