//! Matrices of a few rows, whose factors take no blocks.

/// Replaces a small symmetric matrix by the inverse of its Cholesky factor, row by row, upper triangle zero. False where
/// it is not positive definite, or shorter than `n²`.
#[must_use]
pub fn inverse_of_small_factor(matrix: &mut [f64], n: usize) -> bool {
    if matrix.len() < n * n {
        return false;
    }
    for column in 0..n {
        let known: f64 = (0..column).map(|i| matrix[column * n + i].powi(2)).sum();
        let pivot = matrix[column * n + column] - known;
        if pivot.is_nan() || pivot <= 0.0 || pivot == f64::INFINITY {
            return false;
        }
        let root = pivot.sqrt();
        matrix[column * n + column] = root;
        for row in column + 1..n {
            let known: f64 = (0..column).map(|i| matrix[row * n + i] * matrix[column * n + i]).sum();
            matrix[row * n + column] = (matrix[row * n + column] - known) / root;
            matrix[column * n + row] = 0.0;
        }
    }
    for row in 0..n {
        let pivot = 1.0 / matrix[row * n + row];
        for column in 0..row {
            let known: f64 = (column..row).map(|i| matrix[row * n + i] * matrix[i * n + column]).sum();
            matrix[row * n + column] = -known * pivot;
        }
        matrix[row * n + row] = pivot;
    }
    true
}
