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

/// Inverse of a lower triangle stored row by row, as a full row-major matrix; empty where it is
/// shorter than `n (n + 1) / 2`.
pub fn inverse_of_packed_lower(packed: &[f64], n: usize, out: &mut Vec<f64>) {
    out.clear();
    if packed.len() < n * (n + 1) / 2 {
        return;
    }
    out.resize(n * n, 0.0);
    for row in 0..n {
        let weights = &packed[row * (row + 1) / 2..(row + 1) * (row + 2) / 2];
        for column in 0..=row {
            let known: f64 = (column..row).map(|i| weights[i] * out[i * n + column]).sum();
            let target = if row == column { 1.0 } else { 0.0 };
            out[row * n + column] = (target - known) / weights[row];
        }
    }
}

/// Transposes a square matrix in place; one that is shorter than `n²` stays as it is.
pub fn transpose_square(matrix: &mut [f64], n: usize) {
    if matrix.len() < n * n {
        return;
    }
    for column in 0..n {
        for row in column + 1..n {
            matrix.swap(column * n + row, row * n + column);
        }
    }
}
