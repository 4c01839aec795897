//! Symmetric positive definite systems of a fixed, small size.

/// A pivot, relative to its diagonal entry, below which a matrix counts as singular: what is left of the digits of f64
/// when two unknowns are told apart by their tenth digit.
const LEAST_PIVOT: f64 = 1e-10;

/// A Cholesky factor of a matrix whose rows and columns were scaled to a unit diagonal.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cholesky<const N: usize> {
    lower: [[f64; N]; N],
    scale: [f64; N],
}

impl<const N: usize> Cholesky<N> {
    /// `None` if the matrix is not positive definite, nearly singular or not finite.
    pub fn new(matrix: &[[f64; N]; N]) -> Option<Self> {
        let mut scale = [0.0; N];
        for (i, scale) in scale.iter_mut().enumerate() {
            let diagonal = matrix[i][i];
            if !(diagonal.is_finite() && diagonal > 0.0) {
                return None;
            }
            *scale = 1.0 / diagonal.sqrt();
        }
        let mut lower = [[0.0; N]; N];
        for i in 0..N {
            for j in 0..=i {
                let sum: f64 = (0..j).map(|k| lower[i][k] * lower[j][k]).sum();
                let left = matrix[i][j] * scale[i] * scale[j] - sum;
                if i > j {
                    lower[i][j] = left / lower[j][j];
                } else if left > LEAST_PIVOT {
                    lower[i][i] = left.sqrt();
                } else {
                    return None;
                }
            }
        }
        Some(Self { lower, scale })
    }

    /// Solves `A x = b`.
    pub fn solve(&self, right: &[f64; N]) -> [f64; N] {
        let mut x = [0.0; N];
        for i in 0..N {
            let sum: f64 = (0..i).map(|k| self.lower[i][k] * x[k]).sum();
            x[i] = (right[i] * self.scale[i] - sum) / self.lower[i][i];
        }
        for i in (0..N).rev() {
            let sum: f64 = (i + 1..N).map(|k| self.lower[k][i] * x[k]).sum();
            x[i] = (x[i] - sum) / self.lower[i][i];
        }
        for (x, scale) in x.iter_mut().zip(self.scale) {
            *x *= scale;
        }
        x
    }

    /// The inverse of the matrix.
    pub fn inverse(&self) -> [[f64; N]; N] {
        // Columns of the inverse are its rows: it is symmetric.
        std::array::from_fn(|column| self.solve(&std::array::from_fn(|row| f64::from(u8::from(row == column)))))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn a_badly_scaled_system_is_solved() {
        let base = [[4.0, 1.0, 0.5], [1.0, 3.0, -1.0], [0.5, -1.0, 2.0]];
        let scale = [1e-8, 1.0, 1e9];
        let matrix: [[f64; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|j| base[i][j] * scale[i] * scale[j]));
        let factor = Cholesky::new(&matrix).unwrap();
        let inverse = factor.inverse();
        for i in 0..3 {
            for j in 0..3 {
                let product: f64 = (0..3).map(|k| matrix[i][k] * inverse[k][j]).sum();
                let unit = if i == j { 1.0 } else { 0.0 };
                // Rounding, in the scale of row and column.
                assert!((product - unit).abs() < 1e-13 * (scale[i] / scale[j]).max(1.0), "{i} {j}: {product}");
            }
        }
    }

    #[test]
    fn what_has_no_inverse_is_refused() {
        assert!(Cholesky::new(&[[1.0, 1.0], [1.0, 1.0]]).is_none());
        assert!(Cholesky::new(&[[1.0, 2.0], [2.0, 1.0]]).is_none());
        assert!(Cholesky::new(&[[0.0, 0.0], [0.0, 1.0]]).is_none());
        assert!(Cholesky::new(&[[f64::NAN, 0.0], [0.0, 1.0]]).is_none());
    }
}
