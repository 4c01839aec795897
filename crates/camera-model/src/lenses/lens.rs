//! The lens corrections of Eqs. 8-13, affinity and shear, and their derivatives.

use nalgebra::{Matrix2, SMatrix, Vector2};

use crate::{InteriorOrientation, LensDistortion};

impl LensDistortion {
    /// Names of the seven coefficients in the order of every Jacobian and covariance.
    pub const NAMES: [&'static str; 7] = ["k1", "k2", "k3", "p1", "p2", "b1", "b2"];

    /// The coefficients in the order of [`Self::NAMES`].
    pub fn coefficients(&self) -> [f64; 7] {
        [self.k1, self.k2, self.k3, self.p1, self.p2, self.b1, self.b2]
    }

    /// The lens with the coefficients in the order of [`Self::NAMES`].
    pub fn from_coefficients([k1, k2, k3, p1, p2, b1, b2]: [f64; 7]) -> Self {
        Self { k1, k2, k3, p1, p2, b1, b2 }
    }

    /// Correction `(dx, dy)` in millimetre at the **observed** image point (millimetre), Eqs. 10-13 summed,
    /// with affinity and shear `b1 xb + b2 yb` in x.
    pub fn correction(&self, interior: &InteriorOrientation, observed_mm: [f64; 2]) -> [f64; 2] {
        self.at(interior.reduced(observed_mm)).into()
    }

    /// Derivative of [`Self::correction`] with respect to the observed image point; no unit, and
    /// symmetric where there is no shear.
    pub fn correction_slope(&self, interior: &InteriorOrientation, observed_mm: [f64; 2]) -> Matrix2<f64> {
        self.slope(interior.reduced(observed_mm))
    }

    /// Derivative of [`Self::correction`] with respect to `[k1, k2, k3, p1, p2, b1, b2]`. The correction is linear
    /// in them, so this is its design matrix as well.
    pub fn correction_design(interior: &InteriorOrientation, observed_mm: [f64; 2]) -> SMatrix<f64, 2, 7> {
        Self::design(interior.reduced(observed_mm))
    }

    /// Correction at a point given from the principal point.
    pub(crate) fn at(&self, reduced: Vector2<f64>) -> Vector2<f64> {
        let [x, y] = reduced.into();
        let r2 = reduced.norm_squared();
        let radial = r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3));
        Vector2::new(
            x * radial + self.p1 * (r2 + 2.0 * x * x) + 2.0 * self.p2 * x * y + (self.b1 * x + self.b2 * y),
            y * radial + self.p2 * (r2 + 2.0 * y * y) + 2.0 * self.p1 * x * y,
        )
    }

    /// Derivative of the correction with respect to the point.
    pub(crate) fn slope(&self, reduced: Vector2<f64>) -> Matrix2<f64> {
        let [x, y] = reduced.into();
        let r2 = reduced.norm_squared();
        let radial = r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3));
        let growth = 2.0 * (self.k1 + r2 * (2.0 * self.k2 + r2 * 3.0 * self.k3));
        let mixed = x * y * growth + 2.0 * (self.p1 * y + self.p2 * x);
        Matrix2::new(
            radial + x * x * growth + 6.0 * self.p1 * x + 2.0 * self.p2 * y + self.b1,
            mixed + self.b2,
            mixed,
            radial + y * y * growth + 6.0 * self.p2 * y + 2.0 * self.p1 * x,
        )
    }

    /// Derivative of the correction with respect to the coefficients.
    pub(crate) fn design(reduced: Vector2<f64>) -> SMatrix<f64, 2, 7> {
        let [x, y] = reduced.into();
        let r2 = reduced.norm_squared();
        let [r4, r6] = [r2 * r2, r2 * r2 * r2];
        SMatrix::from_columns(&[
            reduced * r2,
            reduced * r4,
            reduced * r6,
            Vector2::new(r2 + 2.0 * x * x, 2.0 * x * y),
            Vector2::new(2.0 * x * y, r2 + 2.0 * y * y),
            Vector2::new(x, 0.0),
            Vector2::new(y, 0.0),
        ])
    }
}

impl InteriorOrientation {
    /// An image point counted from the principal point: `(x - xp, y - yp)`, millimetre.
    pub(crate) fn reduced(&self, [x, y]: [f64; 2]) -> Vector2<f64> {
        Vector2::new(x - self.principal_point_mm[0], y - self.principal_point_mm[1])
    }
}
