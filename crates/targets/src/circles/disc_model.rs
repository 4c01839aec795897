//! The image of a blurred disc.
//!
//! `I = level(p) + contrast(p) E(p)`: both are planes, `E` is the disc, 1 inside, blurred by a Gaussian of standard deviation σ
//! and averaged over the pixel (nine points, Gauss's rule). With `q = M (p − c)`, `|q| = 1` on the ellipse, and `u = |q| / |M q|`:
//!
//! ```text
//! E = Φ(−s/σ)      s = (|q| − 1) u + σ² det(M)² u³ / 2
//! ```
//!
//! The first term is the distance to the ellipse, to first order; the second moves the edge inwards by half of σ² times its
//! curvature, as blurring does.

use crate::image::normal_table::NormalTable;

/// Number of parameters: level and contrast (value, slope by column, slope by row, each), centre, m11, m12, m22, and β, which
/// gives the blur: see [`blur_px`].
pub(crate) const PARAMETERS: usize = 12;
/// Places of the parameters.
pub(crate) const CONTRAST: usize = 3;
pub(crate) const CENTRE: usize = 6;
pub(crate) const SHAPE: usize = 8;
pub(crate) const BLUR: usize = 11;
/// Blur of the optics that pixels cannot tell from none, pixel: less, and nine points in a pixel are too few.
const SMALLEST_BLUR_PX: f64 = 0.2;
/// Half the width of the bend of the blur, pixel.
const BEND_PX: f64 = 0.2;
/// Points of Gauss's rule on a pixel, pixel, and their weights.
const POINTS: [(f64, f64); 3] =
    [(-0.387_298_334_620_741_7, 5.0 / 18.0), (0.0, 8.0 / 18.0), (0.387_298_334_620_741_7, 5.0 / 18.0)];
/// Beyond so many blurs from the edge the normal distribution is 0 or 1 to 1e-9.
const REACH_BLURS: f64 = 6.0;
/// Within a pixel the distance changes by up to its diagonal, at the ends of long ellipses by more.
const REACH_PX: f64 = 1.5;

/// Parameters of the model, and the place that slopes are counted from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DiscModel {
    /// Where the planes have their value, pixel; held.
    pub(crate) origin: [f64; 2],
}

/// The blur σ = σ₀ + (β + √(β² + w²)) / 2: above the smallest whatever β, and nearly σ₀ + β where that is positive.
pub(crate) fn blur_px(parameters: &[f64]) -> f64 {
    let beta = parameters[BLUR];
    SMALLEST_BLUR_PX + 0.5 * (beta + beta.hypot(BEND_PX))
}

fn blur_by_parameter(parameters: &[f64]) -> f64 {
    let beta = parameters[BLUR];
    0.5 * (1.0 + beta / beta.hypot(BEND_PX))
}

impl DiscModel {
    /// Value of a pixel and its derivatives by the parameters.
    pub(crate) fn value(&self, parameters: &[f64], pixel: [f64; 2]) -> (f64, [f64; PARAMETERS]) {
        let mut derivatives = [0.0; PARAMETERS];
        let plane = [1.0, pixel[0] - self.origin[0], pixel[1] - self.origin[1]];
        let dot = |start: usize| (0..3).map(|k| parameters[start + k] * plane[k]).sum::<f64>();
        let (level, contrast) = (dot(0), dot(CONTRAST));
        let (inside, by_edge) = averaged(parameters, pixel);
        for k in 0..3 {
            derivatives[k] = plane[k];
            derivatives[CONTRAST + k] = inside * plane[k];
        }
        for (out, derivative) in derivatives[CENTRE..].iter_mut().zip(by_edge) {
            *out = contrast * derivative;
        }
        (level + contrast * inside, derivatives)
    }
}

/// E over a pixel, and its derivatives by centre, shape and blur.
fn averaged(parameters: &[f64], pixel: [f64; 2]) -> (f64, [f64; 6]) {
    let blur = blur_px(parameters);
    let (distance, _) = distance(parameters, pixel, blur);
    if distance.abs() > REACH_BLURS * blur + REACH_PX {
        return (if distance < 0.0 { 1.0 } else { 0.0 }, [0.0; 6]);
    }
    let table = NormalTable::new();
    let (mut value, mut derivatives) = (0.0, [0.0; 6]);
    for (dx, column) in POINTS {
        for (dy, row) in POINTS {
            let weight = column * row;
            let (own, by) = at_point(&table, parameters, [pixel[0] + dx, pixel[1] + dy], blur);
            value += weight * own;
            derivatives.iter_mut().zip(by).for_each(|(sum, by)| *sum += weight * by);
        }
    }
    (value, derivatives)
}

fn at_point(table: &NormalTable, parameters: &[f64], point: [f64; 2], blur: f64) -> (f64, [f64; 6]) {
    let (distance, by) = distance(parameters, point, blur);
    let z = distance / blur;
    let (profile, density) = table.profile(z);
    let density = density / blur;
    let mut derivatives = by.map(|by| -density * by);
    // Also by what the distance is divided by.
    derivatives[5] = (derivatives[5] + density * z) * blur_by_parameter(parameters);
    (0.5 * (1.0 - profile), derivatives)
}

/// s and its derivatives by centre, shape and blur.
fn distance(parameters: &[f64], point: [f64; 2], blur: f64) -> (f64, [f64; 6]) {
    let [m11, m12, m22] = [parameters[SHAPE], parameters[SHAPE + 1], parameters[SHAPE + 2]];
    let (dx, dy) = (point[0] - parameters[CENTRE], point[1] - parameters[CENTRE + 1]);
    let apply = |[x, y]: [f64; 2]| [m11 * x + m12 * y, m12 * x + m22 * y];
    let q = apply([dx, dy]);
    let n = apply(q);
    // At the centre itself the direction is open; any will do, as the edge is far.
    let norm = |[x, y]: [f64; 2]| (x * x + y * y).sqrt();
    let (parts, length) = (norm(q).max(1e-9), norm(n).max(1e-12));
    let (u, determinant) = (parts / length, m11 * m22 - m12 * m12);
    let bend = 0.5 * blur * blur * determinant * u * u;
    let by_q = [[-m11, -m12], [-m12, -m22], [dx, 0.0], [dy, dx], [0.0, dy]];
    let by_m_of_q = [[0.0; 2], [0.0; 2], [q[0], 0.0], [q[1], q[0]], [0.0, q[1]]];
    let by_determinant = [0.0, 0.0, m22, -2.0 * m12, m11];
    let mut derivatives = [0.0; 6];
    for k in 0..5 {
        let image = apply(by_q[k]);
        let by_n = [by_m_of_q[k][0] + image[0], by_m_of_q[k][1] + image[1]];
        let by_parts = (q[0] * by_q[k][0] + q[1] * by_q[k][1]) / parts;
        let by_u = by_parts / length - u * (n[0] * by_n[0] + n[1] * by_n[1]) / (length * length);
        derivatives[k] =
            u * by_parts + (parts - 1.0) * by_u + bend * (2.0 * u * by_determinant[k] + 3.0 * determinant * by_u);
    }
    derivatives[5] = blur * determinant * determinant * u * u * u;
    ((parts - 1.0) * u + bend * determinant * u, derivatives)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_are_those_of_differences() {
        let model = DiscModel { origin: [10.0, 12.0] };
        let parameters = [3.0, 0.02, -0.01, 40.0, 0.3, -0.2, 10.3, 11.8, 0.22, 0.05, 0.35, -0.8];
        for pixel in [[8.0, 10.0], [12.0, 13.0], [14.0, 12.0], [10.0, 15.0], [10.0, 12.0]] {
            let (_, derivatives) = model.value(&parameters, pixel);
            for k in 0..PARAMETERS {
                let at = |sign: f64| {
                    let mut moved = parameters;
                    moved[k] += sign * 1e-5;
                    model.value(&moved, pixel).0
                };
                let difference = (at(1.0) - at(-1.0)) / 2e-5;
                // Of values of 40, rounded to 1e-14, over a step of 1e-5; curvature adds the square of the step.
                assert!((derivatives[k] - difference).abs() < 1e-5 * (1.0 + difference.abs()), "{pixel:?} {k}");
            }
        }
    }
}
