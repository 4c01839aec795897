//! Fast point feature histograms `[Rusu2009]`.
//!
//! Three angles describe how the normals n and m of two points at distance vector d stand to each other in the frame
//! `u = n, v = d/|d| × u, w = u × v`: `α = v·m`, `φ = u·d/|d|`, `θ = atan2(w·m, u·m)`, where u is the normal of the point
//! whose normal is closer to the line between them. A histogram of each over the pairs of a point with its
//! neighbours, averaged over the neighbours with weights that fall with their distance, is the descriptor.

use rayon::prelude::*;

use super::descriptors::DescriptorTable;
use super::surface::Normals;
use super::surroundings::Surroundings;

const BINS: usize = 11;
/// Three histograms, padded for the registers.
const WIDTH: usize = 40;
const POINTS_PER_TASK: usize = 256;

/// Descriptors of all points; zeros where a point has no normal or hardly neighbours.
pub(super) fn fpfh(points: &[[f32; 3]], normals: &Normals, surroundings: &Surroundings) -> DescriptorTable {
    let simple: Vec<[f32; WIDTH]> = (0..points.len())
        .into_par_iter()
        .with_min_len(POINTS_PER_TASK)
        .map(|i| simple_histogram(points, normals, surroundings, i))
        .collect();
    let rows: Vec<[f32; WIDTH]> = (0..points.len())
        .into_par_iter()
        .with_min_len(POINTS_PER_TASK)
        .map(|i| if normals.vectors[i][0].is_nan() { [0.0; WIDTH] } else { averaged(&simple, surroundings, i) })
        .collect();
    DescriptorTable::of_histograms(rows.as_flattened().to_vec(), WIDTH)
}

fn simple_histogram(points: &[[f32; 3]], normals: &Normals, surroundings: &Surroundings, i: usize) -> [f32; WIDTH] {
    let mut histogram = [0.0; WIDTH];
    let (p, n) = (points[i], normals.vectors[i]);
    if n[0].is_nan() {
        return histogram;
    }
    let mut count = 0.0_f32;
    for near in surroundings.of(i) {
        let j = near.index as usize;
        let m = normals.vectors[j];
        if m[0].is_nan() {
            continue;
        }
        let d = subtract(points[j], p);
        let scale = 1.0 / near.squared.sqrt();
        let Some([alpha, phi, theta]) = angles(n, m, d.map(|c| c * scale), normals.sided) else { continue };
        histogram[bin(theta * (0.5 / std::f32::consts::PI) + 0.5)] += 1.0;
        histogram[BINS + bin(alpha * 0.5 + 0.5)] += 1.0;
        histogram[2 * BINS + bin(phi * 0.5 + 0.5)] += 1.0;
        count += 1.0;
    }
    if count > 0.0 {
        for value in &mut histogram {
            *value /= count;
        }
    }
    histogram
}

/// The point's own histogram and the mean of those of its neighbours, weighted with the inverse of their distance.
fn averaged(simple: &[[f32; WIDTH]], surroundings: &Surroundings, i: usize) -> [f32; WIDTH] {
    let mut sum = [0.0_f32; WIDTH];
    let mut weights = 0.0;
    for near in surroundings.of(i) {
        let weight = 1.0 / near.squared.sqrt();
        weights += weight;
        for (total, value) in sum.iter_mut().zip(&simple[near.index as usize]) {
            *total += weight * value;
        }
    }
    if weights > 0.0 {
        for (total, own) in sum.iter_mut().zip(&simple[i]) {
            *total = *total / weights + own;
        }
    }
    sum
}

/// α, φ, θ of a pair; `None` where the line runs along the normal. Where normals have no side, the second is turned to
/// the first and the signs that depend on the side are dropped.
#[inline]
pub(super) fn angles(n: [f32; 3], m: [f32; 3], direction: [f32; 3], sided: bool) -> Option<[f32; 3]> {
    let m = if !sided && dot(n, m) < 0.0 { m.map(|c| -c) } else { m };
    let (along_n, along_m) = (dot(n, direction), dot(m, direction));
    // The frame stands on the point whose normal makes the smaller angle with the line to the other.
    let (u, other, d, phi) = if along_n.abs() >= along_m.abs() {
        (n, m, direction, along_n)
    } else {
        (m, n, direction.map(|c| -c), -along_m)
    };
    let v = cross(d, u);
    let length = dot(v, v);
    if length < 1e-8 {
        return None;
    }
    let v = v.map(|c| c / length.sqrt());
    let w = cross(u, v);
    let theta = arctangent(dot(w, other), dot(u, other));
    let alpha = dot(v, other);
    Some(if sided { [alpha, phi, theta] } else { [alpha, phi.abs(), theta.abs()] })
}

#[inline]
fn bin(fraction: f32) -> usize {
    ((fraction * BINS as f32) as usize).min(BINS - 1)
}

/// `atan2` to 2e-4 radian, a thousandth of a bin: a minimax polynomial on the first octant.
#[inline]
pub(super) fn arctangent(y: f32, x: f32) -> f32 {
    let (ax, ay) = (x.abs(), y.abs());
    let (small, large) = (ax.min(ay), ax.max(ay));
    let t = small / large.max(f32::MIN_POSITIVE);
    let s = t * t;
    let octant = ((-0.046_496_475 * s + 0.159_314_22) * s - 0.327_622_76) * s * t + t;
    let quadrant = if ay > ax { std::f32::consts::FRAC_PI_2 - octant } else { octant };
    let half = if x < 0.0 { std::f32::consts::PI - quadrant } else { quadrant };
    if y < 0.0 { -half } else { half }
}

#[inline]
pub(super) fn subtract(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline]
pub(super) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arctangent_is_close_to_the_library() {
        for k in 0..720 {
            let angle = (k as f32 * 0.5 - 179.75).to_radians();
            let found = arctangent(2.0 * angle.sin(), 2.0 * angle.cos());
            // The polynomial's own error.
            assert!((found - angle).abs() < 3e-4, "{angle} {found}");
        }
        assert!(arctangent(0.0, 0.0).is_finite());
    }

    #[test]
    fn angles_do_not_depend_on_the_order_of_the_pair() {
        let unit = |v: [f32; 3]| v.map(|c| c / dot(v, v).sqrt());
        let (n, m, d) = (unit([0.1, 0.2, 0.9]), unit([0.5, -0.3, 0.7]), unit([1.0, 0.4, 0.3]));
        for sided in [true, false] {
            let forward = angles(n, m, d, sided).unwrap_or_default();
            let backward = angles(m, n, d.map(|c| -c), sided).unwrap_or_default();
            for (a, b) in forward.iter().zip(backward) {
                assert!((a - b).abs() < 1e-6);
            }
        }
        // Without sides, turning a normal round changes nothing.
        let turned = angles(n, m.map(|c| -c), d, false).unwrap_or_default();
        for (a, b) in angles(n, m, d, false).unwrap_or_default().iter().zip(turned) {
            assert!((a - b).abs() < 1e-6);
        }
    }
}
