//! Space resection from three points in closed form: Grunert's solution in the formulation of `[Haralick1994]`.
//!
//! The unknown distances `s1, s2 = u s1, s3 = v s1` from the perspective centre satisfy three laws of cosines; `v` is a
//! root of a quartic. Up to four solutions are real and positive.

use nalgebra::{Isometry3, Matrix4, Point3, Schur, Vector3};
use rigid_pose::absolute_orientation;

/// A root counts as real up to this share of imaginary part: noise makes double roots complex, and what comes from
/// here is an approximation that the adjustment improves or drops.
const NEARLY_REAL: f64 = 0.1;

/// Poses `world_from_camera` from which three points (world, metre) are seen along three unit rays (camera frame).
pub(crate) fn poses_from_three_points(points: &[Point3<f64>; 3], rays: &[Vector3<f64>; 3]) -> Vec<Isometry3<f64>> {
    let triangle = Triangle::new(points, rays);
    let poses = roots(&triangle.quartic()).into_iter().filter_map(|v| {
        let distances = triangle.distances(v)?;
        let in_camera: [Point3<f64>; 3] = std::array::from_fn(|i| Point3::from(rays[i] * distances[i]));
        let orientation = absolute_orientation(&in_camera, points, None).ok()?;
        Some(orientation.target_from_source)
    });
    poses.collect()
}

/// Squared sides opposite to the three points and cosines of the angles between the rays to the other two.
struct Triangle {
    squared_sides: [f64; 3],
    cosines: [f64; 3],
}

impl Triangle {
    fn new(points: &[Point3<f64>; 3], rays: &[Vector3<f64>; 3]) -> Self {
        let opposite = |i: usize| ((i + 1) % 3, (i + 2) % 3);
        Self {
            squared_sides: std::array::from_fn(|i| (points[opposite(i).0] - points[opposite(i).1]).norm_squared()),
            cosines: std::array::from_fn(|i| rays[opposite(i).0].dot(&rays[opposite(i).1])),
        }
    }

    /// Coefficients of the quartic in `v`, constant term first.
    fn quartic(&self) -> [f64; 5] {
        let [a2, b2, c2] = self.squared_sides;
        let [cos_a, cos_b, cos_c] = self.cosines;
        let difference = (a2 - c2) / b2;
        let sum = (a2 + c2) / b2;
        let all = cos_a * cos_b * cos_c;
        [
            (1.0 + difference).powi(2) - 4.0 * a2 / b2 * cos_c * cos_c,
            4.0 * (-difference * (1.0 + difference) * cos_b + 2.0 * a2 / b2 * cos_c * cos_c * cos_b
                - (1.0 - sum) * cos_a * cos_c),
            2.0 * (difference.powi(2) - 1.0
                + 2.0 * difference.powi(2) * cos_b * cos_b
                + 2.0 * (b2 - c2) / b2 * cos_a * cos_a
                - 4.0 * sum * all
                + 2.0 * (b2 - a2) / b2 * cos_c * cos_c),
            4.0 * (difference * (1.0 - difference) * cos_b - (1.0 - sum) * cos_a * cos_c
                + 2.0 * c2 / b2 * cos_a * cos_a * cos_b),
            (difference - 1.0).powi(2) - 4.0 * c2 / b2 * cos_a * cos_a,
        ]
    }

    /// The three distances that belong to a root, `None` where they are not positive.
    fn distances(&self, v: f64) -> Option<[f64; 3]> {
        let [a2, b2, c2] = self.squared_sides;
        let [cos_a, cos_b, cos_c] = self.cosines;
        let s1_squared = b2 / (1.0 + v * v - 2.0 * v * cos_b);
        // u from the law of cosines of the side between the first two; the sign is that which closes the third side.
        // The linear equation for u that eliminates the sign has a denominator that vanishes in symmetric cases.
        let half = (cos_c * cos_c - 1.0 + c2 / s1_squared).max(0.0).sqrt();
        let gap = |u: f64| (s1_squared * (u * u + v * v - 2.0 * u * v * cos_a) - a2).abs();
        let [first, second] = [cos_c + half, cos_c - half];
        let u = if gap(first) <= gap(second) { first } else { second };
        let s1 = s1_squared.sqrt();
        let distances = [s1, u * s1, v * s1];
        distances.iter().all(|s| s.is_finite() && *s > 0.0).then_some(distances)
    }
}

/// Nearly real roots of a quartic (constant term first) as eigenvalues of its companion matrix.
fn roots(coefficients: &[f64; 5]) -> Vec<f64> {
    let mut ordered = *coefficients;
    // A small leading coefficient would blow the matrix up: the reversed polynomial has the reciprocal roots.
    let is_reversed = coefficients[4].abs() < coefficients[0].abs();
    if is_reversed {
        ordered.reverse();
    }
    let [e, d, c, b, a] = ordered;
    let companion =
        Matrix4::new(-b / a, -c / a, -d / a, -e / a, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0);
    if companion.iter().any(|value| !value.is_finite()) {
        return Vec::new();
    }
    let Some(schur) = Schur::try_new(companion, f64::EPSILON, 1000) else { return Vec::new() };
    let eigenvalues = schur.complex_eigenvalues();
    let real = eigenvalues.iter().filter(|root| root.im.abs() <= NEARLY_REAL * root.norm()).map(|root| root.re);
    real.map(|root| if is_reversed { root.recip() } else { root }).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use proptest::prelude::*;

    fn vector() -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-1.0..1.0_f64).prop_map(Vector3::from)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]

        #[test]
        fn the_true_pose_is_among_the_solutions(
            points in prop::array::uniform3(vector()),
            axis in vector(),
            position in vector(),
        ) {
            let in_camera = points.map(|p| p + Vector3::new(0.0, 0.0, -3.0));
            let area = (points[1] - points[0]).cross(&(points[2] - points[0])).norm();
            prop_assume!(area > 0.1);
            let pose = Isometry3::new(position, axis * 3.0);
            let world = in_camera.map(|p| pose * Point3::from(p));
            let rays = in_camera.map(|p| p.normalize());
            let found = poses_from_three_points(&world, &rays);
            let nearest = found.iter().map(|f| f.rotation.angle_to(&pose.rotation)).fold(f64::INFINITY, f64::min);
            // The quartic's roots are good to the square root of rounding where two of them meet.
            prop_assert!(nearest < 1e-4, "{nearest}");
        }
    }

    #[test]
    fn symmetric_triangles() {
        // Equilateral, seen along its axis: u's linear equation has a zero denominator there.
        let points: [Point3<f64>; 3] = std::array::from_fn(|i| {
            let angle = i as f64 * std::f64::consts::TAU / 3.0;
            Point3::new(angle.cos(), angle.sin(), -2.0)
        });
        let found = poses_from_three_points(&points, &points.map(|p| p.coords.normalize()));
        let nearest = found.iter().map(|pose| pose.translation.vector.norm()).fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-6, "{found:?}");
    }

    #[test]
    fn quartics() {
        // (x - 1)(x - 2)(x + 3)(x - 0.5)
        let mut found = roots(&[-3.0, 9.5, -7.0, -0.5, 1.0]);
        found.sort_by(f64::total_cmp);
        assert_eq!(found.len(), 4);
        // Simple roots are good to rounding times their condition, about 10 here.
        assert!(found.iter().zip([-3.0, 0.5, 1.0, 2.0]).all(|(root, expected)| (root - expected).abs() < 1e-12));
        // x^4 + 1 has no real root, and a vanishing polynomial none to speak of.
        assert!(roots(&[1.0, 0.0, 0.0, 0.0, 1.0]).is_empty());
        assert!(roots(&[0.0; 5]).is_empty());
        // A vanishing leading coefficient: x (x - 2) (x + 2) + 0 x^4 loses the root at infinity only.
        assert!(roots(&[1.0, -4.0, 0.0, 1.0, 0.0]).iter().any(|x| (x * x * x - 4.0 * x + 1.0).abs() < 1e-9));
    }
}
