//! Where spheres may be: a sphere through the points of a round window, at each of a grid of pixels.

use nalgebra::{Matrix4, Point3, Vector3, Vector4};
use range_image::Raster;

use super::options::SphereOptions;

/// Radius of the window in parts of the sphere's: a third of the radius deep, and clear of the limb.
const WINDOW_PARTS: f64 = 0.75;
/// Steps between pixels of the grid and between points of the window, in parts of the window: some window lies well inside, and no
/// more than about 250 points make it.
const GRID_PARTS: f64 = 0.4;
const POINT_PARTS: f64 = 0.11;
/// Ratio of the radii that are tried one after the other.
const RADIUS_STEP: f64 = 1.35;
/// Smallest window, pixel: below it a sphere cannot be told from noise.
const SMALLEST_WINDOW_PX: f64 = 2.5;
/// Radius that a window gives against the one it is made for: noise, and the next radius.
const RADIUS_RATIO: f64 = 1.5;
/// How far the ray of the window's middle passes the centre, in parts of the radius.
const LARGEST_OFFSET: f64 = 0.5;
/// Root mean square distance from the sphere in parts of the radius, and in sigmas: with a third of the radius of depth, a plane has
/// 0.09.
const LARGEST_RMS: f64 = 0.06;
const LARGEST_RMS_SIGMAS: f64 = 1.5;

/// A sphere that may be there, camera frame, metre.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    pub(super) centre: Point3<f64>,
    pub(super) radius_m: f64,
    rms_m: f64,
}

/// The points of a frame and the angle of its pixels.
pub(super) struct Points<'a> {
    pub(super) raster: &'a Raster<Vector3<f64>>,
    pub(super) sigmas_m: &'a Raster<f64>,
    /// Angle of a pixel in the middle of the image, radian.
    pub(super) pixel_rad: f64,
}

/// Candidates, the best first, none within another.
pub(super) fn candidates(frame: &Points<'_>, options: &SphereOptions) -> Vec<Candidate> {
    let [smallest, largest] = options.range_m();
    let mut found = Vec::new();
    let mut radius = smallest;
    loop {
        at_radius(frame, radius, &mut found);
        if radius * RADIUS_STEP.sqrt() >= largest {
            break;
        }
        radius = (radius * RADIUS_STEP).min(largest);
    }
    found.sort_by(|a: &Candidate, b| (a.rms_m / a.radius_m).total_cmp(&(b.rms_m / b.radius_m)));
    let mut kept: Vec<Candidate> = Vec::new();
    for candidate in found {
        let near = |other: &Candidate| (other.centre - candidate.centre).norm() < 0.5 * other.radius_m;
        if !kept.iter().any(near) {
            kept.push(candidate);
        }
    }
    kept
}

fn at_radius(frame: &Points<'_>, radius: f64, found: &mut Vec<Candidate>) {
    let (width, height) = (frame.raster.width(), frame.raster.height());
    // The grid is as narrow as the farthest, smallest windows need where the pixel lies.
    for row in 0..height {
        for col in 0..width {
            let seed = frame.raster[(col, row)];
            let window = WINDOW_PARTS * radius / (seed.norm() * frame.pixel_rad);
            if !(window >= SMALLEST_WINDOW_PX && window < width.max(height) as f64) {
                continue;
            }
            let step = ((GRID_PARTS * window) as usize).max(1);
            if col % step == 0 && row % step == 0 {
                found.extend(through_window(frame, [col, row], window, radius));
            }
        }
    }
}

fn through_window(frame: &Points<'_>, [col, row]: [usize; 2], window: f64, radius: f64) -> Option<Candidate> {
    let seed = frame.raster[(col, row)];
    let step = ((POINT_PARTS * window) as usize).max(1);
    let range = |middle: usize, size: usize| {
        let reach = window as usize / step * step;
        let first = if middle >= reach { middle - reach } else { middle % step };
        (first..(middle + reach + 1).min(size)).step_by(step)
    };
    let (mut points, mut squares, mut looked_at) = (Vec::new(), 0.0, 0_usize);
    for r in range(row, frame.raster.height()) {
        for c in range(col, frame.raster.width()) {
            if (c as f64 - col as f64).powi(2) + (r as f64 - row as f64).powi(2) > window * window {
                continue;
            }
            looked_at += 1;
            let point = frame.raster[(c, r)] - seed;
            if point.norm() <= 2.0 * WINDOW_PARTS * radius {
                points.push(point);
                squares += frame.sigmas_m[(c, r)].powi(2);
            }
        }
    }
    if points.len() < 10 || 4 * points.len() < 3 * looked_at {
        return None;
    }
    let sigma = (squares / points.len() as f64).sqrt();
    let (centre, found) = sphere_through(&points)?;
    let rms = (points.iter().map(|point| ((point - centre).norm() - found).powi(2)).sum::<f64>() / points.len() as f64)
        .sqrt();
    let ray = seed.normalize();
    let centre = seed + centre;
    let offset = (centre - ray * ray.dot(&centre)).norm();
    let good = (found / radius).max(radius / found) <= RADIUS_RATIO
        && rms <= LARGEST_RMS * radius + LARGEST_RMS_SIGMAS * sigma
        && offset <= LARGEST_OFFSET * found
        && ray.dot(&centre) > seed.norm() + 0.5 * found;
    good.then_some(Candidate { centre: centre.into(), radius_m: found, rms_m: rms })
}

/// The sphere of least algebraic error: `|p|² = 2 cᵀ p + (R² − |c|²)`.
fn sphere_through(points: &[Vector3<f64>]) -> Option<(Vector3<f64>, f64)> {
    let (mut normal, mut right) = (Matrix4::zeros(), Vector4::zeros());
    for point in points {
        let row = Vector4::new(2.0 * point.x, 2.0 * point.y, 2.0 * point.z, 1.0);
        normal += row * row.transpose();
        right += row * point.norm_squared();
    }
    let solved = normal.cholesky()?.solve(&right);
    let centre = Vector3::new(solved.x, solved.y, solved.z);
    let radius = (solved.w + centre.norm_squared()).sqrt();
    (radius.is_finite() && radius > 0.0).then_some((centre, radius))
}
