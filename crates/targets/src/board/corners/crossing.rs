//! Values about a corner: two straight edges that cross, blurred by a Gaussian, on light that falls off.
//!
//! ```text
//! I(q) = (o + c F(q)) (1 + g · q)      F = S₁ S₂ + K      Sₖ = P(dₖ) − P(dₖ − Lₖ⁺) − P(dₖ + Lₖ⁻)
//! ```
//!
//! with dₖ the distance from edge k, P(d) = 2Φ(d/σ) − 1 the profile of an edge, and L± the distances to the parallel edges on
//! both sides. The product is exact for edges at right angles; for others K, of the correlation ρ that the blur has across
//! both edges, makes it so: `K = ∫₀^asin ρ 2/π exp(−(a² − 2ab sin t + b²) / 2cos²t) dt` with a, b = d/σ \[Genz2004\].

use crate::image::normal_table::NormalTable;

/// Parameters in their order: corner (col, row) from the middle of the window, directions of the normals of both edges
/// (radian), blur σ (pixel), offset o, half contrast c (unit of the image), slope g of the light (per pixel, col and row).
pub(super) type Parameters = [f64; 9];

/// Exponent beyond which the bell of K is nothing: 6e-6 of the contrast.
const FAR: f64 = 12.0;

/// The edges of a corner.
pub(super) struct Crossing<'a> {
    pub(super) table: &'a NormalTable,
    /// Distances of the parallel edges before and behind each edge, along its normal, pixel; infinite where there are none.
    pub(super) spans: [[f64; 2]; 2],
}

/// The edges at some parameters, to be evaluated at many places.
pub(super) struct Evaluation<'a> {
    crossing: &'a Crossing<'a>,
    parameters: Parameters,
    normals: [[f64; 2]; 2],
    correlation: f64,
    /// Sine of the angle from the second normal to the first: signed √(1 − ρ²).
    sine: f64,
    /// Sine, 1 / 2cos² and weight of the nodes of the integral, and last of its end.
    nodes: [[f64; 3]; LEGENDRE.len() + 1],
}

/// S, its slope along the distance and that along σ.
struct Wave {
    value: f64,
    slope: f64,
    by_blur: f64,
}

impl<'a> Crossing<'a> {
    /// The edges with these parameters.
    pub(super) fn with(&'a self, parameters: &Parameters) -> Evaluation<'a> {
        let normals = [parameters[2], parameters[3]].map(|angle| [angle.cos(), angle.sin()]);
        let (sine, correlation) = (parameters[2] - parameters[3]).sin_cos();
        let end = correlation.asin();
        let mut nodes = [[0.0; 3]; LEGENDRE.len() + 1];
        for (node, [place, weight]) in nodes.iter_mut().zip(LEGENDRE.into_iter().chain([[1.0, 0.0]])) {
            let (s, c) = (0.5 * end * (1.0 + place)).sin_cos();
            *node = [s, 0.5 / (c * c), 0.5 * end * weight];
        }
        Evaluation { crossing: self, parameters: *parameters, normals, correlation, sine, nodes }
    }

    /// Three parallel edges.
    fn wave(&self, distance: f64, [before, behind]: [f64; 2], blur: f64) -> Wave {
        let edge = |d: f64| {
            let (profile, density) = self.table.profile(d / blur);
            let slope = if density > 0.0 { 2.0 * density / blur } else { 0.0 };
            // The distance may be infinite where the slope is zero.
            let by_blur = if slope > 0.0 { -d / blur * slope } else { 0.0 };
            [profile, slope, by_blur]
        };
        let [own, next, last] = [edge(distance), edge(distance - behind), edge(distance + before)];
        let sum = |k: usize| own[k] - next[k] - last[k];
        Wave { value: sum(0), slope: sum(1), by_blur: sum(2) }
    }
}

impl Evaluation<'_> {
    /// The value at a place from the middle of the window, where the edges have bent so far along their normals, and its
    /// derivatives by all parameters.
    pub(super) fn value(&self, [x, y]: [f64; 2], bend: [f64; 2]) -> (f64, Parameters) {
        let [px, py, _, _, blur, offset, contrast, gx, gy] = self.parameters;
        let (dx, dy) = (x - px, y - py);
        let normals = self.normals;
        let distances = [0, 1].map(|k| normals[k][0] * dx + normals[k][1] * dy - bend[k]);
        let waves = [0, 1].map(|k| self.crossing.wave(distances[k], self.crossing.spans[k], blur));
        let (oblique, by_oblique) = self.oblique(distances.map(|d| d / blur));
        let pattern = waves[0].value * waves[1].value + oblique;
        let by_distance = [
            waves[0].slope * waves[1].value + by_oblique[0] / blur,
            waves[1].slope * waves[0].value + by_oblique[1] / blur,
        ];
        let by_blur = waves[0].by_blur * waves[1].value + waves[1].by_blur * waves[0].value
            - (distances[0] * by_oblique[0] + distances[1] * by_oblique[1]) / (blur * blur);
        let light = 1.0 + gx * x + gy * y;
        let level = offset + contrast * pattern;
        let scale = contrast * light;
        // A turn of the normal moves the edge along itself.
        let turn = |k: usize| by_distance[k] * (normals[k][0] * dy - normals[k][1] * dx);
        let derivatives = [
            -scale * (by_distance[0] * normals[0][0] + by_distance[1] * normals[1][0]),
            -scale * (by_distance[0] * normals[0][1] + by_distance[1] * normals[1][1]),
            scale * (turn(0) + by_oblique[2]),
            scale * (turn(1) - by_oblique[2]),
            scale * by_blur,
            light,
            light * pattern,
            level * x,
            level * y,
        ];
        (level * light, derivatives)
    }

    /// K at distances in deviations, and its derivatives by both and by the angle of the first normal.
    fn oblique(&self, [a, b]: [f64; 2]) -> (f64, [f64; 3]) {
        let (sum, product) = (a * a + b * b, 2.0 * a * b);
        // The exponent of the bell is at least that, all along the integral.
        let far = sum > 2.0 * FAR * (1.0 + self.correlation.abs());
        if far || self.sine.abs() < 1e-3 {
            return (0.0, [0.0; 3]);
        }
        let bell = |[s, inverse, _]: [f64; 3]| (-(sum - product * s) * inverse).exp() * std::f64::consts::FRAC_2_PI;
        let value = self.nodes[..LEGENDRE.len()].iter().map(|node| node[2] * bell(*node)).sum::<f64>();
        let table = self.crossing.table;
        let given = |a: f64, b: f64| {
            let (free, density) = (table.profile(b).0, table.profile(a).1);
            2.0 * density * (table.profile((b - self.correlation * a) / self.sine.abs()).0 - free)
        };
        // dρ = −sin dθ, and the bell is that by asin ρ.
        (value, [given(a, b), given(b, a), -bell(self.nodes[LEGENDRE.len()]) * self.sine.signum()])
    }
}

/// Nodes and weights of Gauss and Legendre on −1 to 1: five are exact to 1e-7 up to a correlation of 0.8.
const LEGENDRE: [[f64; 2]; 5] = [
    [0.0, 0.568_888_888_888_888_9],
    [-0.538_469_310_105_683_1, 0.478_628_670_499_366_5],
    [0.538_469_310_105_683_1, 0.478_628_670_499_366_5],
    [-0.906_179_845_938_664, 0.236_926_885_056_189_1],
    [0.906_179_845_938_664, 0.236_926_885_056_189_1],
];

#[cfg(test)]
mod tests {
    use super::*;

    const PARAMETERS: Parameters = [0.3, -0.2, 0.4, 1.6, 0.9, 100.0, -60.0, 0.01, -0.02];

    fn crossing(table: &NormalTable) -> Crossing<'_> {
        Crossing { table, spans: [[4.5, 5.0], [5.5, f64::INFINITY]] }
    }

    #[test]
    fn derivatives_are_differences() {
        let table = NormalTable::new();
        let crossing = crossing(&table);
        for place in [[0.1, 0.2], [1.5, -0.6], [-2.0, 2.0], [3.0, 0.4], [4.4, -3.9], [-6.0, 6.0]] {
            let (_, derivatives) = crossing.with(&PARAMETERS).value(place, [0.1, -0.2]);
            for k in 0..9 {
                let step = 1e-4 * PARAMETERS[k].abs().max(1.0);
                let moved = |sign: f64| {
                    let mut parameters = PARAMETERS;
                    parameters[k] += sign * step;
                    crossing.with(&parameters).value(place, [0.1, -0.2]).0
                };
                let difference = (moved(1.0) - moved(-1.0)) / (2.0 * step);
                assert!((difference - derivatives[k]).abs() < 2e-4, "{place:?} {k}: {difference} {}", derivatives[k]);
            }
        }
    }

    #[test]
    fn oblique_edges_are_those_of_a_blurred_picture() {
        // The picture of two edges at 45 degrees, averaged over a Gaussian.
        let table = NormalTable::new();
        let crossing = Crossing { table: &table, spans: [[f64::INFINITY; 2]; 2] };
        let (first, second, blur) = (0.2_f64, 0.2 + std::f64::consts::FRAC_PI_4, 0.8);
        for [x, y] in [[0.0, 0.0], [0.5, -0.3], [-0.7, 0.9]] {
            let (mut sum, mut weights) = (0.0, 0.0);
            for k in -200..200 {
                for l in -200..200 {
                    let (u, v) = ((f64::from(k) + 0.37) * 0.02, (f64::from(l) + 0.61) * 0.02);
                    let weight = (-0.5 * (u * u + v * v) / (blur * blur)).exp();
                    let side = |angle: f64| ((x + u) * angle.cos() + (y + v) * angle.sin()).signum();
                    sum += weight * side(first) * side(second);
                    weights += weight;
                }
            }
            let parameters = [0.0, 0.0, first, second, blur, 0.0, 1.0, 0.0, 0.0];
            let (value, _) = crossing.with(&parameters).value([x, y], [0.0; 2]);
            // The sum has steps of 0.02 pixel along the edges.
            assert!((value - sum / weights).abs() < 1e-3, "{value} {}", sum / weights);
        }
    }
}
