use nalgebra::{Matrix2, Matrix5, SMatrix};

/// An ellipse in an image, pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ellipse {
    /// Its centre `(col, row)`.
    pub centre: [f64; 2],
    /// Semi-major and semi-minor axis, pixel.
    pub semi_axes_px: [f64; 2],
    /// Direction of the major axis, radian, from the columns towards the rows (clockwise as seen), above −π/2 up to π/2.
    pub direction_rad: f64,
}

impl Ellipse {
    /// The symmetric matrix M that maps the ellipse, counted from its centre, to the unit circle.
    pub(crate) fn to_unit_circle(self) -> Matrix2<f64> {
        let (sine, cosine) = self.direction_rad.sin_cos();
        let [long, short] = self.semi_axes_px.map(f64::recip);
        let across = cosine * sine * (long - short);
        Matrix2::new(
            long * cosine * cosine + short * sine * sine,
            across,
            across,
            long * sine * sine + short * cosine * cosine,
        )
    }

    /// The ellipse whose [`Self::to_unit_circle`] has the elements `[m11, m12, m22]`.
    pub(crate) fn from_unit_circle(centre: [f64; 2], [m11, m12, m22]: [f64; 3]) -> Self {
        let (mean, half) = (0.5 * (m11 + m22), (0.5 * (m11 - m22)).hypot(m12));
        let direction_rad = 0.5 * f64::atan2(-2.0 * m12, m22 - m11);
        Self { centre, semi_axes_px: [(mean - half).recip(), (mean + half).recip()], direction_rad }
    }

    /// The ellipse of a full region with these second central moments, square pixel: its axes are twice the deviations.
    pub(crate) fn from_moments(centre: [f64; 2], [xx, xy, yy]: [f64; 3]) -> Self {
        let (mean, half) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
        let axis = |square: f64| 2.0 * square.max(0.0).sqrt();
        let direction_rad = 0.5 * f64::atan2(2.0 * xy, xx - yy);
        Self { centre, semi_axes_px: [axis(mean + half), axis(mean - half)], direction_rad }
    }

    /// Derivatives of the semi-axes and the direction by `[m11, m12, m22]`. Of a circle that of the direction is not finite.
    fn by_unit_circle(self, [m11, m12, m22]: [f64; 3]) -> SMatrix<f64, 3, 3> {
        let (sine, cosine) = self.direction_rad.sin_cos();
        let [a, b] = self.semi_axes_px;
        let (x, y) = (m22 - m11, -2.0 * m12);
        let square = 2.0 * (x * x + y * y);
        SMatrix::<f64, 3, 3>::new(
            -a * a * cosine * cosine,
            -2.0 * a * a * cosine * sine,
            -a * a * sine * sine,
            -b * b * sine * sine,
            2.0 * b * b * cosine * sine,
            -b * b * cosine * cosine,
            y / square,
            -2.0 * x / square,
            -y / square,
        )
    }

    /// Covariance of `[col, row, semi-major, semi-minor, direction]` from that of `[col, row, m11, m12, m22]`.
    pub(crate) fn covariance(self, elements: [f64; 3], covariance: &Matrix5<f64>) -> Matrix5<f64> {
        let mut derivative = Matrix5::identity();
        derivative.fixed_view_mut::<3, 3>(2, 2).copy_from(&self.by_unit_circle(elements));
        derivative * covariance * derivative.transpose()
    }

    /// Distance from the centre in parts of the ellipse: below 1 inside.
    pub(crate) fn parts(&self, unit_circle: &Matrix2<f64>, pixel: [f64; 2]) -> f64 {
        (unit_circle * nalgebra::Vector2::new(pixel[0] - self.centre[0], pixel[1] - self.centre[1])).norm()
    }

    /// The point of the ellipse at the parameter `angle` (radian), from the end of the major axis on.
    pub fn point(&self, angle: f64) -> [f64; 2] {
        let (sine, cosine) = self.direction_rad.sin_cos();
        let [x, y] = [self.semi_axes_px[0] * angle.cos(), self.semi_axes_px[1] * angle.sin()];
        [self.centre[0] + cosine * x - sine * y, self.centre[1] + sine * x + cosine * y]
    }

    /// Radius of the circle of the same area, pixel.
    pub fn mean_radius_px(&self) -> f64 {
        (self.semi_axes_px[0] * self.semi_axes_px[1]).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ELLIPSE: Ellipse = Ellipse { centre: [3.0, -2.0], semi_axes_px: [7.0, 4.0], direction_rad: 0.6 };

    #[test]
    fn the_matrix_and_back() {
        let m = ELLIPSE.to_unit_circle();
        let again = Ellipse::from_unit_circle(ELLIPSE.centre, [m.m11, m.m12, m.m22]);
        assert!((again.semi_axes_px[0] - 7.0).abs() < 1e-12 && (again.semi_axes_px[1] - 4.0).abs() < 1e-12);
        assert!((again.direction_rad - 0.6).abs() < 1e-12);
        for angle in [0.0, 1.0, 4.0] {
            assert!((ELLIPSE.parts(&m, ELLIPSE.point(angle)) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        let m = ELLIPSE.to_unit_circle();
        let elements = [m.m11, m.m12, m.m22];
        let derivative = ELLIPSE.by_unit_circle(elements);
        for column in 0..3 {
            let at = |sign: f64| {
                let mut moved = elements;
                moved[column] += sign * 1e-6;
                let ellipse = Ellipse::from_unit_circle([0.0; 2], moved);
                [ellipse.semi_axes_px[0], ellipse.semi_axes_px[1], ellipse.direction_rad]
            };
            for row in 0..3 {
                let difference = (at(1.0)[row] - at(-1.0)[row]) / 2e-6;
                assert!((derivative[(row, column)] - difference).abs() < 1e-6 * (1.0 + difference.abs()));
            }
        }
    }
}
