//! Fast point feature histograms `[Rusu2009]`.
//!
//! Three angles describe how the normals n and m of two points at distance vector d stand to each other in the frame
//! `u = n, v = d/|d| × u, w = u × v`: `α = v·m`, `φ = u·d/|d|`, `θ = atan2(w·m, u·m)`, where u is the normal of the point
//! whose normal is closer to the line between them. A histogram of each over the pairs of a point with its
//! neighbours, averaged over the neighbours with weights that fall with their distance, is the descriptor.

// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use rayon::prelude::*;

use crate::description::descriptors::DescriptorTable;
use crate::description::surface::Normals;
use crate::description::surroundings::Surroundings;

const BINS: usize = 11;
/// Three histograms, padded for the registers.
const WIDTH: usize = 40;
/// Entry of the padding that takes pairs without angles.
const NOWHERE: usize = WIDTH - 1;
/// What is computed side by side: pairs here, columns where descriptors are compared.
pub(crate) const LANES: usize = 16;

/// Descriptors of all points; zeros where a point has no normal or hardly neighbours.
pub(crate) fn fpfh(points: &[[f32; 3]], normals: &Normals, surroundings: &Surroundings) -> DescriptorTable {
    let simple = pulp::Arch::new().dispatch(Simple { points, normals, surroundings });
    let rows: Vec<[f32; WIDTH]> = (0..points.len())
        .into_par_iter()
        .map(|i| if normals.vectors[i][0].is_nan() { [0.0; WIDTH] } else { averaged(&simple, surroundings, i) })
        .collect();
    DescriptorTable::of_histograms(rows.as_flattened().to_vec(), WIDTH)
}

/// The histograms of each point's own pairs, each summing up to 1. A pair counts for both of its points and is computed
/// once. A closure would not be compiled for wide registers.
struct Simple<'a> {
    points: &'a [[f32; 3]],
    normals: &'a Normals,
    surroundings: &'a Surroundings,
}

impl pulp::NullaryFnOnce for Simple<'_> {
    type Output = Vec<[f32; WIDTH]>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        let Self { points, normals, surroundings } = self;
        let mut counts = vec![[0_u16; WIDTH]; points.len()];
        let mut block = [0_u32; LANES];
        for i in (0..points.len()).filter(|&i| !normals.vectors[i][0].is_nan()) {
            let mut filled = 0;
            for near in surroundings.of(i) {
                // Written always, kept only if it counts: no branch to be guessed.
                block[filled] = near.index;
                let j = near.index as usize;
                // Every second pair: some forty neighbours fill the histograms as well as eighty.
                filled += usize::from(j > i && (i + j).is_multiple_of(2) && !normals.vectors[j][0].is_nan());
                if filled == LANES {
                    add_pairs(points, normals, i, &block, &mut counts);
                    filled = 0;
                }
            }
            add_pairs(points, normals, i, &block[..filled], &mut counts);
        }
        let scaled = |row: [u16; WIDTH]| {
            let total: u32 = row[..BINS].iter().map(|c| u32::from(*c)).sum();
            let scale = 1.0 / total.max(1) as f32;
            let mut row = row.map(|c| f32::from(c) * scale);
            row[NOWHERE] = 0.0;
            row
        };
        counts.into_iter().map(scaled).collect()
    }
}

#[inline(always)]
fn add_pairs(points: &[[f32; 3]], normals: &Normals, i: usize, others: &[u32], counts: &mut [[u16; WIDTH]]) {
    let (p, n) = (points[i], normals.vectors[i]);
    let mut lanes = [[0.0_f32; LANES]; 6];
    for (lane, &j) in others.iter().enumerate() {
        let (q, m) = (points[j as usize], normals.vectors[j as usize]);
        for k in 0..3 {
            lanes[k][lane] = q[k] - p[k];
            lanes[3 + k][lane] = m[k];
        }
    }
    let mut places = [[0_u32; LANES]; 3];
    for lane in 0..LANES {
        let d = [lanes[0][lane], lanes[1][lane], lanes[2][lane]];
        let m = [lanes[3][lane], lanes[4][lane], lanes[5][lane]];
        let scale = 1.0 / dot(d, d).max(f32::MIN_POSITIVE).sqrt();
        let [alpha, phi, theta, length] = angles(n, m, d.map(|c| c * scale), normals.sided);
        let is_known = length >= SHORTEST;
        let place = |first: usize, fraction: f32| {
            let bin = first as u32 + ((fraction * BINS as f32) as u32).min(BINS as u32 - 1);
            if is_known { bin } else { NOWHERE as u32 }
        };
        places[0][lane] = place(0, theta * (0.5 / std::f32::consts::PI) + 0.5);
        places[1][lane] = place(BINS, alpha * 0.5 + 0.5);
        places[2][lane] = place(2 * BINS, phi * 0.5 + 0.5);
    }
    for (lane, &j) in others.iter().enumerate() {
        for place in &places {
            let place = place[lane] as usize;
            counts[i][place] = counts[i][place].saturating_add(1);
            counts[j as usize][place] = counts[j as usize][place].saturating_add(1);
        }
    }
}

/// The point's own histogram and the mean of those of every second neighbour, weighted with the inverse of their distance.
fn averaged(simple: &[[f32; WIDTH]], surroundings: &Surroundings, i: usize) -> [f32; WIDTH] {
    let mut sum = [0.0_f32; WIDTH];
    let mut weights = 0.0;
    for near in surroundings.of(i).iter().step_by(2) {
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

/// Squared sine of the angle between line and normal below which there is no frame.
const SHORTEST: f32 = 1e-8;

/// α, φ, θ of a pair, and the squared sine of the angle between line and normal. Where normals have no side, the second
/// is turned to the first and the signs that depend on the side are dropped.
#[inline(always)]
fn angles(n: [f32; 3], m: [f32; 3], direction: [f32; 3], sided: bool) -> [f32; 4] {
    let m = if !sided && dot(n, m) < 0.0 { m.map(|c| -c) } else { m };
    let (along_n, along_m) = (dot(n, direction), dot(m, direction));
    // The frame stands on the point whose normal makes the smaller angle with the line to the other.
    let on_first = along_n.abs() >= along_m.abs();
    let choose = |a: f32, b: f32| if on_first { a } else { b };
    let u = [choose(n[0], m[0]), choose(n[1], m[1]), choose(n[2], m[2])];
    let other = [choose(m[0], n[0]), choose(m[1], n[1]), choose(m[2], n[2])];
    let turn = choose(1.0, -1.0);
    let phi = turn * choose(along_n, along_m);
    let v = cross(direction.map(|c| turn * c), u);
    let length = dot(v, v);
    let scale = 1.0 / length.max(SHORTEST).sqrt();
    let v = v.map(|c| c * scale);
    let w = cross(u, v);
    let theta = arctangent(dot(w, other), dot(u, other));
    let alpha = dot(v, other);
    if sided { [alpha, phi, theta, length] } else { [alpha, phi.abs(), theta.abs(), length] }
}

/// `atan2` to 2e-4 radian, a thousandth of a bin: a minimax polynomial on the first octant.
#[inline(always)]
fn arctangent(y: f32, x: f32) -> f32 {
    let (ax, ay) = (x.abs(), y.abs());
    let (small, large) = (ax.min(ay), ax.max(ay));
    let t = small / large.max(f32::MIN_POSITIVE);
    let s = t * t;
    let octant = ((-0.046_496_475 * s + 0.159_314_22) * s - 0.327_622_76) * s * t + t;
    let quadrant = if ay > ax { std::f32::consts::FRAC_PI_2 - octant } else { octant };
    let half = if x < 0.0 { std::f32::consts::PI - quadrant } else { quadrant };
    if y < 0.0 { -half } else { half }
}

#[inline(always)]
pub(crate) fn subtract(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(crate) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
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
            let forward = angles(n, m, d, sided);
            let backward = angles(m, n, d.map(|c| -c), sided);
            for (a, b) in forward.iter().zip(backward) {
                assert!((a - b).abs() < 1e-6);
            }
        }
        // Without sides, turning a normal round changes nothing.
        let turned = angles(n, m.map(|c| -c), d, false);
        for (a, b) in angles(n, m, d, false).iter().zip(turned) {
            assert!((a - b).abs() < 1e-6);
        }
    }
}
