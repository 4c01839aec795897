//! Planes tell their distance: seen from a point, a plane's range is curved by an amount that grows with the range,
//! so the curvature of a wrapped range image says which wrap count makes walls and floors plane.

use std::f32::consts::TAU;

use crate::ImageGeometry;
use crate::image::surface::Surface;
use crate::tree::forest::{Forest, NO_LABEL};
use crate::tree::grid::Grid;

/// Samples a side of a block, whatever its size in pixels.
const SIDE: usize = 8;
/// Angular sizes of the blocks, radian, coarse to fine: walls, furniture, near objects. A choice; larger blocks tell
/// curvature better and find fewer planes of their size.
const BLOCK_ANGLES: [f32; 3] = [0.16, 0.08, 0.04];
/// Standard deviation, cycles/rad^2, allowed to a plane's curvature beyond noise: systematic errors of the range. A
/// choice, of the size of what lens and range terms leave; without it quiet walls would be certain of what systematic
/// errors bend.
const CURVATURE_ERROR: f64 = 0.15;
/// Density, (cycles/rad^2)^-3, of the curvatures of all other surfaces, times their share of the blocks: 30 % of them,
/// spread over +-10 cycles/rad^2 in each component. A choice on which the figures of `tests/absolute.rs` with geometry
/// rest.
const CURVED_DENSITY: f64 = 0.3 / 8000.0;
/// Share of plane blocks. The rest of the share above.
const PLANE_SHARE: f64 = 0.7;
/// Blocks overlap by half in both directions, so each pixel is seen by four.
const OVERLAP: f64 = 4.0;
/// Largest total, nats, that curvature may say about one segment: systematic errors are common to its blocks. Below the
/// cost of a seed, above that of the frame before; a larger one lets a wall with a lens error overrule brightness.
const LIMIT: f32 = 12.0;

/// Solid angle, sr, of a segment at which half of the limit holds: a ball can curve like a far plane, a wall cannot. A
/// choice, a wall of 1.3 m at 3 m; a smaller one trusts small objects.
const HALF_LIMIT_SOLID_ANGLE: f32 = 0.2;

/// Steps along an axis whose mean is taken as a slope.
const MEAN_SLOPE_STEPS: u32 = 8;

/// Evidence from curvature, and slopes for the angle of incidence.
#[derive(Debug, Default)]
pub(crate) struct Planes {
    /// `[segment][label]`: cost in nats.
    pub costs: Vec<f32>,
    /// Slope of the range along columns and rows, cycles per unit of the image at principal distance 1; NaN unknown.
    pub slope: Vec<[f32; 2]>,
    sums: Vec<f64>,
    /// Unwrapped phase of each pixel, cycles, which several blocks share.
    cycles: Vec<f32>,
}

/// Quadratic fit of a block: value, gradient, second derivatives with their variances.
struct Patch {
    value: f64,
    gradient: [f64; 2],
    curvature: [f64; 3],
    variance: [f64; 3],
    gradient_variance: f64,
}

impl Planes {
    /// Measures all blocks that lie in one segment.
    pub fn measure(
        &mut self,
        grid: &Grid,
        surface: &Surface,
        forest: &Forest,
        geometry: &ImageGeometry,
        pixels: &[u32],
        labels: usize,
    ) {
        self.sums.clear();
        self.sums.resize(forest.components * labels, 0.0);
        self.set_mean_slopes(grid, surface, forest, geometry);
        let pixels_of = surface.phase.iter().zip(&forest.wraps);
        self.cycles.clear();
        self.cycles.extend(pixels_of.map(|(phase, wraps)| phase / TAU + *wraps as f32));
        let mut finest = 0;
        for angle in BLOCK_ANGLES {
            // Each sample stands for `spacing` pixels a side.
            let spacing = ((angle * geometry.principal_distance_px) / SIDE as f32).round() as usize;
            if spacing == 0 || spacing == finest {
                continue;
            }
            finest = spacing;
            self.measure_scale(grid, forest, geometry, labels, spacing);
        }
        self.costs.clear();
        for (sums, &pixels) in self.sums.chunks_exact(labels).zip(pixels) {
            let best = sums.iter().copied().fold(f64::INFINITY, f64::min);
            let solid_angle = pixels as f32 / geometry.principal_distance_px.powi(2);
            let limit = LIMIT * solid_angle / (solid_angle + HALF_LIMIT_SOLID_ANGLE);
            self.costs.extend(sums.iter().map(|sum| limit * ((sum - best) as f32 / limit.max(1e-6)).tanh()));
        }
    }

    /// The mean slope of each segment, which serves where no block fits: small and slender segments.
    fn set_mean_slopes(&mut self, grid: &Grid, surface: &Surface, forest: &Forest, geometry: &ImageGeometry) {
        let mut means = vec![[(0.0_f32, 0_u32); 2]; forest.components];
        for pixel in grid.inner().filter(|&pixel| forest.label[pixel] != NO_LABEL) {
            let mean = &mut means[forest.label[pixel] as usize];
            for (axis, other) in [(0, pixel + 1), (1, pixel + grid.stride)] {
                if forest.label[other] == forest.label[pixel] {
                    let step = (surface.phase[other] - surface.phase[pixel]) / TAU
                        + (forest.wraps[other] - forest.wraps[pixel]) as f32;
                    mean[axis] = (mean[axis].0 + step, mean[axis].1 + 1);
                }
            }
        }
        let slope = |(sum, n): (f32, u32)| {
            if n < MEAN_SLOPE_STEPS { f32::NAN } else { sum / n as f32 * geometry.principal_distance_px }
        };
        let slopes: Vec<[f32; 2]> = means.iter().map(|&axes| axes.map(slope)).collect();
        self.slope.clear();
        let known = |&label: &u32| slopes.get(label as usize).copied().unwrap_or([f32::NAN; 2]);
        self.slope.extend(forest.label.iter().map(known));
    }

    fn measure_scale(&mut self, grid: &Grid, forest: &Forest, geometry: &ImageGeometry, labels: usize, spacing: usize) {
        let block = SIDE * spacing;
        let half = block / 2;
        for row in (0..(grid.height + 1).saturating_sub(block)).step_by(half) {
            for col in (0..(grid.width + 1).saturating_sub(block)).step_by(half) {
                let corner = grid.index(col, row);
                let Some((segment, samples)) = sample(grid, &self.cycles, &forest.label, corner, spacing) else {
                    continue;
                };
                let distance = f64::from(geometry.principal_distance_px);
                let middle = |first: usize, point: f32| {
                    (first as f64 + (SIDE as f64 - 1.0) / 2.0 * spacing as f64 - f64::from(point)) / distance
                };
                let [x, y] = [middle(col, geometry.principal_point_px[0]), middle(row, geometry.principal_point_px[1])];
                let patch = fit(&samples, spacing as f64 / distance);
                let likelihood = Likelihood::new(&patch);
                for label in 0..labels {
                    let predicted = plane_curvature(x, y, patch.value + label as f64, patch.gradient);
                    self.sums[segment * labels + label] += likelihood.cost(predicted) / OVERLAP;
                }
                if patch.gradient_variance.sqrt() < 0.5 {
                    self.set_slope(grid, corner, block, patch.gradient);
                }
            }
        }
    }

    /// The middle quarter of a block takes its slope; these quarters tile the image.
    fn set_slope(&mut self, grid: &Grid, corner: usize, block: usize, gradient: [f64; 2]) {
        let slope = gradient.map(|g| g as f32);
        for row in block / 4..block - block / 4 {
            let start = corner + row * grid.stride + block / 4;
            self.slope[start..start + block / 2].fill(slope);
        }
    }
}

/// Means of the squares of a block, in cycles; `None` where it leaves the segment of its first pixel.
fn sample(
    grid: &Grid,
    cycles: &[f32],
    labels: &[u32],
    corner: usize,
    spacing: usize,
) -> Option<(usize, [f64; SIDE * SIDE])> {
    let (label, length) = (labels[corner], SIDE * spacing);
    if label == NO_LABEL {
        return None;
    }
    let rows = (0..length).map(|row| corner + row * grid.stride);
    // Without an end before that of a row, labels are compared side by side.
    let leaves = |row: &[u32]| row.iter().fold(0, |any, other| any | (other ^ label)) != 0;
    if rows.clone().any(|start| leaves(&labels[start..start + length])) {
        return None;
    }
    let mut sums = [0.0_f32; SIDE * SIDE];
    for (row, start) in rows.enumerate() {
        let sums = &mut sums[row / spacing * SIDE..][..SIDE];
        for (sum, pixels) in sums.iter_mut().zip(cycles[start..start + length].chunks_exact(spacing)) {
            *sum = pixels.iter().fold(*sum, |sum, value| sum + value);
        }
    }
    Some((label as usize, sums.map(|sum| f64::from(sum) / (spacing * spacing) as f64)))
}

/// Least squares of a quadratic over the lattice, by orthogonal polynomials; `pitch` is the lattice spacing.
fn fit(samples: &[f64; SIDE * SIDE], pitch: f64) -> Patch {
    const N: f64 = (SIDE * SIDE) as f64;
    const MIDDLE: f64 = (SIDE as f64 - 1.0) / 2.0;
    // Second and fourth moments of the positions -(S-1)/2 .. (S-1)/2.
    const S2: f64 = (SIDE * SIDE) as f64;
    let (m2, m4) = ((S2 - 1.0) / 12.0, (S2 - 1.0) * (3.0 * S2 - 7.0) / 240.0);
    let norms = [N, N * m2, N * m2, N * (m4 - m2 * m2), N * m2 * m2, N * (m4 - m2 * m2)];
    let mut sums = [0.0; 6];
    let mut squares = 0.0;
    // Polynomials of the column are summed over each row, and these of the row over all of them.
    for (row, values) in samples.chunks_exact(SIDE).enumerate() {
        let (y, mut of_row) = (row as f64 - MIDDLE, [0.0; 3]);
        for (col, value) in values.iter().enumerate() {
            let x = col as f64 - MIDDLE;
            of_row[0] += value;
            of_row[1] += x * value;
            of_row[2] += (x * x - m2) * value;
            squares += value * value;
        }
        let [plain, slope, bend] = of_row;
        let terms = [plain, slope, y * plain, bend, y * slope, (y * y - m2) * plain];
        sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
    }
    let explained: f64 = sums.iter().zip(norms).map(|(sum, norm)| sum * sum / norm).sum();
    let variance = ((squares - explained) / (N - 6.0)).max(1e-12);
    let coefficient = |i: usize| sums[i] / norms[i];
    let scale = pitch.powi(-2);
    let second = variance * scale * scale;
    Patch {
        value: coefficient(0) - m2 * (coefficient(3) + coefficient(5)),
        gradient: [coefficient(1) / pitch, coefficient(2) / pitch],
        curvature: [2.0 * coefficient(3) * scale, coefficient(4) * scale, 2.0 * coefficient(5) * scale],
        variance: [4.0 * second / norms[3], second / norms[4], 4.0 * second / norms[5]],
        gradient_variance: variance / norms[1] / (pitch * pitch),
    }
}

/// Second derivatives of the range of the plane with this range and gradient at image point `(x, y)`.
///
/// With `N = sqrt(1 + x^2 + y^2)` a plane has `rho = N / D`, D linear in x and y.
fn plane_curvature(x: f64, y: f64, range: f64, gradient: [f64; 2]) -> [f64; 3] {
    let n = (1.0 + x * x + y * y).sqrt();
    let [nx, ny] = [x / n, y / n];
    let [nxx, nxy, nyy] = [(1.0 - nx * nx) / n, -nx * ny / n, (1.0 - ny * ny) / n];
    let range = range.max(1e-3);
    let d = n / range;
    let [dx, dy] = [(nx - gradient[0] * d) / range, (ny - gradient[1] * d) / range];
    let second = |nab: f64, na: f64, nb: f64, da: f64, db: f64| {
        nab / d - (na * db + nb * da) / (d * d) + 2.0 * n * da * db / (d * d * d)
    };
    [second(nxx, nx, nx, dx, dx), second(nxy, nx, ny, dx, dy), second(nyy, ny, ny, dy, dy)]
}

/// Logarithm of the cosine of the incidence angle for a range and slope at an image point.
pub(crate) fn log_cosine(x: f32, y: f32, range: f32, slope: [f32; 2]) -> f32 {
    let n = (1.0 + x * x + y * y).sqrt();
    let d = n / range;
    let [dx, dy] = [(x / n - slope[0] * d) / range, (y / n - slope[1] * d) / range];
    let constant = d - dx * x - dy * y;
    // The plane is m . u = 1 / rho with m = (dx, dy, constant) up to axes, and the cosine is (m . u) / |m|.
    -(range * (dx * dx + dy * dy + constant * constant).sqrt()).ln()
}

/// How likely curvatures are that are predicted for a patch; what they have in common is found once.
struct Likelihood {
    measured: [f64; 3],
    variance: [f64; 3],
    /// Density, (cycles/rad^2)^-3, of a plane's curvature where it is as predicted.
    density: f64,
}

impl Likelihood {
    fn new(patch: &Patch) -> Self {
        let variance = patch.variance.map(|variance| variance + CURVATURE_ERROR * CURVATURE_ERROR);
        let volume = std::f64::consts::TAU.powi(3) * variance.iter().product::<f64>();
        Self { measured: patch.curvature, variance, density: PLANE_SHARE / volume.sqrt() }
    }

    /// Minus the logarithm of the density of planes and other surfaces together.
    fn cost(&self, predicted: [f64; 3]) -> f64 {
        let parts = self.measured.iter().zip(predicted).zip(self.variance);
        let exponent: f64 =
            parts.map(|((measured, predicted), variance)| (measured - predicted).powi(2) / variance).sum();
        -(CURVED_DENSITY + self.density * (-0.5 * exponent).exp()).ln()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Range of a slanted plane at an image point.
    fn plane(x: f64, y: f64) -> f64 {
        (1.0 + x * x + y * y).sqrt() / (0.7 + 0.3 * x - 0.5 * y)
    }

    #[test]
    fn curvature_and_cosine_are_those_of_a_plane() {
        let (x, y, h) = (0.2, -0.1, 1e-3);
        let at = |i: i32, j: i32| plane(x + f64::from(i) * h, y + f64::from(j) * h);
        let gradient = [(at(1, 0) - at(-1, 0)) / (2.0 * h), (at(0, 1) - at(0, -1)) / (2.0 * h)];
        let numeric = [
            (at(1, 0) - 2.0 * at(0, 0) + at(-1, 0)) / (h * h),
            (at(1, 1) - at(1, -1) - at(-1, 1) + at(-1, -1)) / (4.0 * h * h),
            (at(0, 1) - 2.0 * at(0, 0) + at(0, -1)) / (h * h),
        ];
        let analytic = plane_curvature(x, y, at(0, 0), gradient);
        for (a, n) in analytic.iter().zip(numeric) {
            // Truncation is h^2 times fourth derivatives of a few tens.
            assert!((a - n).abs() < 1e-4, "{a} {n}");
        }
        // Normal (0.3, -0.5, 0.7) against the ray (0.2, -0.1, 1).
        let cosine = (0.06_f64 + 0.05 + 0.7) / (0.83_f64.sqrt() * 1.05_f64.sqrt());
        let found = log_cosine(x as f32, y as f32, at(0, 0) as f32, gradient.map(|g| g as f32));
        // Single precision, and gradients by differences.
        assert!((f64::from(found) - cosine.ln()).abs() < 1e-4, "{found} {}", cosine.ln());
    }

    #[test]
    fn a_quadratic_is_fitted_exactly() {
        let pitch = 0.01;
        let mut samples = [0.0; SIDE * SIDE];
        for (index, sample) in samples.iter_mut().enumerate() {
            let (x, y) = ((index % SIDE) as f64 - 3.5, (index / SIDE) as f64 - 3.5);
            let (x, y) = (x * pitch, y * pitch);
            *sample = 1.5 + 2.0 * x - y + 0.5 * 3.0 * x * x + 4.0 * x * y - 0.5 * 5.0 * y * y;
        }
        let patch = fit(&samples, pitch);
        let found = [patch.value, patch.gradient[0], patch.gradient[1]];
        for (found, truth) in found.iter().chain(&patch.curvature).zip([1.5, 2.0, -1.0, 3.0, 4.0, -5.0]) {
            // Rounding of values near 1 divided by the squared pitch.
            assert!((found - truth).abs() < 1e-9, "{found} {truth}");
        }
    }
}
