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
/// Blur from which on the fourth moment of a pixel, in which it differs from a normal distribution, changes E by less than 1e-3,
/// pixel.
pub(crate) const SMOOTH_PX: f64 = 0.6;
/// Half the width of the bend of the blur, pixel.
const BEND_PX: f64 = 0.2;
/// Variance of the place within a pixel along an axis, square pixel.
const PIXEL_VARIANCE: f64 = 1.0 / 12.0;
/// Points of Gauss's rule on a pixel, pixel, and their weights.
const POINTS: [(f64, f64); 3] =
    [(-0.387_298_334_620_741_7, 5.0 / 18.0), (0.0, 8.0 / 18.0), (0.387_298_334_620_741_7, 5.0 / 18.0)];
/// Beyond so many blurs from the edge the normal distribution is 0 or 1 to 3e-5.
const REACH_BLURS: f64 = 4.0;
/// Within a pixel the distance changes by up to half its diagonal, at the ends of long ellipses by more.
const REACH_PX: f64 = 1.0;

/// Parameters of the model, and the place that slopes are counted from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DiscModel {
    /// Where the planes have their value, pixel; held.
    pub(crate) origin: [f64; 2],
    /// Whether the edge is blurred so widely that a pixel may stand for a point, its own variance added to the blur.
    pub(crate) is_smooth: bool,
}

/// The blur σ = σ₀ + (β + √(β² + w²)) / 2: above the smallest whatever β, and nearly σ₀ + β where that is positive.
pub(crate) fn blur_px(parameters: &[f64]) -> f64 {
    let beta = parameters[BLUR];
    SMALLEST_BLUR_PX + 0.5 * (beta + (beta * beta + BEND_PX * BEND_PX).sqrt())
}

fn blur_by_parameter(parameters: &[f64]) -> f64 {
    let beta = parameters[BLUR];
    0.5 * (1.0 + beta / (beta * beta + BEND_PX * BEND_PX).sqrt())
}

impl DiscModel {
    /// Value of a pixel and its derivatives by the parameters.
    pub(crate) fn value(&self, table: &NormalTable, parameters: &[f64], pixel: [f64; 2]) -> (f64, [f64; PARAMETERS]) {
        let mut derivatives = [0.0; PARAMETERS];
        let plane = [1.0, pixel[0] - self.origin[0], pixel[1] - self.origin[1]];
        let dot = |start: usize| (0..3).map(|k| parameters[start + k] * plane[k]).sum::<f64>();
        let (level, contrast) = (dot(0), dot(CONTRAST));
        let inside = if self.is_smooth { inside_at_point } else { averaged };
        let (inside, by_edge) = inside(table, parameters, pixel);
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
#[inline]
fn averaged(table: &NormalTable, parameters: &[f64], pixel: [f64; 2]) -> (f64, [f64; 6]) {
    let blur = blur_px(parameters);
    let (distance, _) = distance(parameters, pixel, blur);
    if distance.abs() > REACH_BLURS * blur + REACH_PX {
        return (if distance < 0.0 { 1.0 } else { 0.0 }, [0.0; 6]);
    }
    let (mut value, mut derivatives) = (0.0, [0.0; 6]);
    for (dx, column) in POINTS {
        for (dy, row) in POINTS {
            let weight = column * row;
            let (own, by) = at_point(table, parameters, [pixel[0] + dx, pixel[1] + dy], blur);
            value += weight * own;
            derivatives.iter_mut().zip(by).for_each(|(sum, by)| *sum += weight * by);
        }
    }
    derivatives[5] *= blur_by_parameter(parameters);
    (value, derivatives)
}

/// E at a pixel's middle, the pixel taken as a point and its own variance as blur, and its derivatives by centre, shape and blur.
pub(crate) fn inside_at_point(table: &NormalTable, parameters: &[f64], pixel: [f64; 2]) -> (f64, [f64; 6]) {
    let blur = blur_px(parameters);
    let whole = (blur * blur + PIXEL_VARIANCE).sqrt();
    let (value, mut derivatives) = at_point(table, parameters, pixel, whole);
    derivatives[5] *= blur / whole * blur_by_parameter(parameters);
    (value, derivatives)
}

/// E at a point, and its derivatives by centre, shape and σ.
#[inline]
fn at_point(table: &NormalTable, parameters: &[f64], point: [f64; 2], blur: f64) -> (f64, [f64; 6]) {
    let (distance, by) = distance(parameters, point, blur);
    let z = distance / blur;
    let (profile, density) = table.profile(z);
    let density = density / blur;
    let mut derivatives = by.map(|by| -density * by);
    // Also by what the distance is divided by.
    derivatives[5] += density * z;
    (0.5 * (1.0 - profile), derivatives)
}

/// s and its derivatives by centre, shape and σ.
#[inline]
fn distance(parameters: &[f64], point: [f64; 2], blur: f64) -> (f64, [f64; 6]) {
    let [m11, m12, m22] = [parameters[SHAPE], parameters[SHAPE + 1], parameters[SHAPE + 2]];
    let (dx, dy) = (point[0] - parameters[CENTRE], point[1] - parameters[CENTRE + 1]);
    let apply = |[x, y]: [f64; 2]| [m11 * x + m12 * y, m12 * x + m22 * y];
    let (q, determinant) = (apply([dx, dy]), m11 * m22 - m12 * m12);
    let n = apply(q);
    // At the centre itself the direction is open; any will do, as the edge is far.
    let norm = |[x, y]: [f64; 2]| (x * x + y * y).sqrt();
    let (parts, length) = (norm(q).max(1e-9), norm(n).max(1e-12));
    let per_length = 1.0 / length;
    let u = parts * per_length;
    let bend = 0.5 * blur * blur * determinant * u * u;
    // By u, and backwards from there by |q|, |M q| and det M, by q and M q.
    let by_u = parts - 1.0 + 3.0 * determinant * bend;
    let (to_q, to_n) = ((u + by_u * per_length) / parts, -by_u * u * per_length * per_length);
    let by_determinant = 2.0 * bend * u;
    let r = [to_n * n[0], to_n * n[1]];
    let back = apply(r);
    let w = [to_q * q[0] + back[0], to_q * q[1] + back[1]];
    let by_centre = apply(w);
    let derivatives = [
        -by_centre[0],
        -by_centre[1],
        w[0] * dx + r[0] * q[0] + by_determinant * m22,
        w[0] * dy + w[1] * dx + r[0] * q[1] + r[1] * q[0] - 2.0 * by_determinant * m12,
        w[1] * dy + r[1] * q[1] + by_determinant * m11,
        blur * determinant * determinant * u * u * u,
    ];
    ((parts - 1.0) * u + bend * determinant * u, derivatives)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_as_a_point_is_nearly_its_mean_and_has_its_own_derivatives() {
        let parameters = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 10.3, 11.8, 0.22, 0.05, 0.35, 0.4];
        let table = NormalTable::new();
        for pixel in [[8.0, 10.0], [12.0, 13.0], [14.0, 12.0], [10.0, 15.0]] {
            let (value, derivatives) = inside_at_point(&table, &parameters, pixel);
            // At the smallest blur that is taken for smooth.
            assert!((blur_px(&parameters) - SMOOTH_PX).abs() < 0.03);
            assert!((value - averaged(&table, &parameters, pixel).0).abs() < 1e-3, "{pixel:?}");
            for k in 0..6 {
                let at = |sign: f64| {
                    let mut moved = parameters;
                    moved[CENTRE + k] += sign * 1e-5;
                    inside_at_point(&table, &moved, pixel).0
                };
                let difference = (at(1.0) - at(-1.0)) / 2e-5;
                assert!((derivatives[k] - difference).abs() < 1e-5, "{pixel:?} {k}");
            }
        }
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        let table = NormalTable::new();
        let parameters = [3.0, 0.02, -0.01, 40.0, 0.3, -0.2, 10.3, 11.8, 0.22, 0.05, 0.35, -0.8];
        for pixel in [[8.0, 10.0], [12.0, 13.0], [14.0, 12.0], [10.0, 15.0], [10.0, 12.0]] {
            let model = DiscModel { origin: [10.0, 12.0], is_smooth: pixel[0] < 9.0 };
            let (_, derivatives) = model.value(&table, &parameters, pixel);
            for k in 0..PARAMETERS {
                let at = |sign: f64| {
                    let mut moved = parameters;
                    moved[k] += sign * 1e-5;
                    model.value(&table, &moved, pixel).0
                };
                let difference = (at(1.0) - at(-1.0)) / 2e-5;
                // Of values of 40, rounded to 1e-14, over a step of 1e-5; curvature adds the square of the step.
                assert!((derivatives[k] - difference).abs() < 1e-5 * (1.0 + difference.abs()), "{pixel:?} {k}");
            }
        }
    }
}
