//! The projective map of a plane onto a plane.

use nalgebra::{Matrix3, SMatrix, Vector2, Vector3};

/// A projective map of a plane onto another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Homography(Matrix3<f64>);

impl Homography {
    /// The map that takes the first point of each pair to the second, by the least algebraic error of centred and scaled
    /// points \[Hartley1997\]. `None` of fewer than four pairs, of points that are not finite and of points that do not
    /// settle it (three of four on a line).
    pub(crate) fn fit(pairs: &[(Vector2<f64>, Vector2<f64>)]) -> Option<Self> {
        if pairs.len() < 4 {
            return None;
        }
        let from = Centring::of(pairs.iter().map(|pair| pair.0))?;
        let to = Centring::of(pairs.iter().map(|pair| pair.1))?;
        let mut normal = SMatrix::<f64, 9, 9>::zeros();
        for (source, target) in pairs {
            let (p, q) = (from.apply(*source), to.apply(*target));
            for (axis, value) in [q.x, q.y].into_iter().enumerate() {
                let mut row = SMatrix::<f64, 9, 1>::zeros();
                for (k, coordinate) in [p.x, p.y, 1.0].into_iter().enumerate() {
                    row[3 * axis + k] = coordinate;
                    row[6 + k] = -value * coordinate;
                }
                normal += row * row.transpose();
            }
        }
        let eigen = normal.symmetric_eigen();
        let mut order: Vec<usize> = (0..9).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
        // Two vanishing eigenvalues are two maps: 1e-10 of the largest is rounding of centred and scaled points.
        if eigen.eigenvalues[order[1]].is_nan() || eigen.eigenvalues[order[1]] <= 1e-10 * eigen.eigenvalues[order[8]] {
            return None;
        }
        let least = eigen.eigenvectors.column(order[0]);
        let centred = Matrix3::from_fn(|row, col| least[3 * row + col]);
        let map = Self(to.undone() * centred * from.matrix());
        // On one side of the horizon only.
        let depth = |point: Vector2<f64>| (map.0 * Vector3::new(point.x, point.y, 1.0)).z;
        let sign = depth(pairs[0].0).signum();
        pairs.iter().all(|pair| depth(pair.0) * sign > 0.0).then_some(Self(map.0 * sign))
    }

    /// The images of the two axes of the first plane, as homogeneous coordinates.
    pub(crate) fn directions(&self) -> [Vector3<f64>; 2] {
        [0, 1].map(|axis| self.0.column(axis).into_owned())
    }

    /// Area of the image of a small figure over its own; `None` on and behind the horizon.
    pub(crate) fn area_scale(&self, point: Vector2<f64>) -> Option<f64> {
        let depth = (self.0 * Vector3::new(point.x, point.y, 1.0)).z;
        (depth > 0.0).then(|| self.0.determinant().abs() / depth.powi(3))
    }

    /// Centre of the ellipse that the image of a circle is; `None` where the circle reaches the horizon.
    ///
    /// The dual conic of the circle, c cᵀ − r² (e₁ e₁ᵀ + e₂ e₂ᵀ) with its centre c, is mapped as points are; the centre is the
    /// last column of what it becomes.
    pub(crate) fn ellipse_centre(&self, centre: Vector2<f64>, radius: f64) -> Option<Vector2<f64>> {
        let image = self.0 * Vector3::new(centre.x, centre.y, 1.0);
        let [right, up] = self.directions();
        let square = radius * radius;
        let last = image * image.z - square * (right * right.z + up * up.z);
        (image.z > 0.0 && last.z > 0.0).then(|| last.xy() / last.z)
    }

    /// Where a point is mapped to; `None` on and behind the horizon.
    pub(crate) fn map(&self, point: Vector2<f64>) -> Option<Vector2<f64>> {
        let mapped = self.0 * Vector3::new(point.x, point.y, 1.0);
        (mapped.z > 0.0).then(|| mapped.xy() / mapped.z)
    }
}

/// A shift and a scale after which points lie about the origin at a mean distance of √2.
struct Centring {
    centre: Vector2<f64>,
    scale: f64,
}

impl Centring {
    fn of(points: impl Iterator<Item = Vector2<f64>> + Clone) -> Option<Self> {
        let count = points.clone().count() as f64;
        let centre = points.clone().sum::<Vector2<f64>>() / count;
        let scale = std::f64::consts::SQRT_2 * count / points.map(|point| (point - centre).norm()).sum::<f64>();
        (scale.is_finite() && scale > 0.0).then_some(Self { centre, scale })
    }

    fn apply(&self, point: Vector2<f64>) -> Vector2<f64> {
        (point - self.centre) * self.scale
    }

    fn matrix(&self) -> Matrix3<f64> {
        let (c, s) = (self.centre, self.scale);
        Matrix3::new(s, 0.0, -s * c.x, 0.0, s, -s * c.y, 0.0, 0.0, 1.0)
    }

    fn undone(&self) -> Matrix3<f64> {
        let (c, s) = (self.centre, 1.0 / self.scale);
        Matrix3::new(s, 0.0, c.x, 0.0, s, c.y, 0.0, 0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn tilted(p: Vector2<f64>) -> Vector2<f64> {
        Vector2::new(20.0 * p.x - 3.0 * p.y + 100.0, 4.0 * p.x + 17.0 * p.y + 50.0) / (1.0 + 0.03 * p.x - 0.02 * p.y)
    }

    #[test]
    fn a_perspective_is_reproduced() {
        let nodes = (0..12).map(|k| Vector2::new(f64::from(k % 4), f64::from(k / 4)));
        let pairs: Vec<_> = nodes.map(|node| (node, tilted(node))).collect();
        let map = Homography::fit(&pairs).unwrap();
        let beyond = Vector2::new(6.0, -2.5);
        assert!((map.map(beyond).unwrap() - tilted(beyond)).norm() < 1e-8);
    }

    #[test]
    fn the_ellipse_of_a_circle_has_the_centre_of_its_chords() {
        let nodes = (0..12).map(|k| Vector2::new(f64::from(k % 4), f64::from(k / 4)));
        let map = Homography::fit(&nodes.map(|node| (node, tilted(node))).collect::<Vec<_>>()).unwrap();
        let (centre, radius) = (Vector2::new(1.0, 2.0), 0.4);
        let found = map.ellipse_centre(centre, radius).unwrap();
        // Chords through the centre of an ellipse are halved by it.
        let rim: Vec<_> = (0..3600).map(|k| f64::from(k) * std::f64::consts::TAU / 3600.0).collect();
        let rim: Vec<_> = rim.iter().map(|a| tilted(centre + radius * Vector2::new(a.cos(), a.sin()))).collect();
        for first in rim.iter().step_by(200) {
            let opposite = 2.0 * found - first;
            let off = rim.iter().map(|point| (point - opposite).norm()).fold(f64::INFINITY, f64::min);
            assert!(off < 0.02, "{off}");
        }
        assert!((found - tilted(centre)).norm() > 0.05, "it is not the image of the circle's centre");
        let area: f64 = (0..3600).map(|k| rim[k].perp(&rim[(k + 1) % 3600]) / 2.0).sum();
        let small = map.area_scale(centre).unwrap() * std::f64::consts::PI * radius * radius;
        assert!((area.abs() / small - 1.0).abs() < 0.01, "{area} {small}");
        assert!(map.ellipse_centre(Vector2::new(0.0, 60.0), 1.0).is_none(), "beyond the horizon");
    }

    #[test]
    fn points_on_a_line_and_no_numbers_have_no_map() {
        let line: Vec<_> = (0..6).map(|k| Vector2::new(f64::from(k), 2.0 * f64::from(k))).map(|p| (p, p)).collect();
        assert!(Homography::fit(&line).is_none());
        assert!(Homography::fit(&line[..3]).is_none());
        let nan = vec![(Vector2::new(f64::NAN, 0.0), Vector2::zeros()); 5];
        assert!(Homography::fit(&nan).is_none());
        let same = vec![(Vector2::zeros(), Vector2::zeros()); 5];
        assert!(Homography::fit(&same).is_none());
    }
}
