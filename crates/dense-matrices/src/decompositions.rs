//! Dense decompositions. Matrices are column-major slices; always one thread, so that the same input gives the same bits
//! everywhere; sizes of zero and values that are not finite never reach the library that does the work.

#[cfg(feature = "faer")]
use crate::with_faer as library;
#[cfg(not(feature = "faer"))]
use crate::with_nalgebra as library;
use crate::{Error, Result};

fn finite(matrix: &[f64]) -> bool {
    matrix.iter().all(|value| value.is_finite())
}

/// `A = L Lᵀ` in place, lower triangle only. False where a pivot is not positive: then A is not usable.
#[must_use]
pub fn cholesky(matrix: &mut [f64], n: usize) -> bool {
    n == 0 || finite(matrix) && library::cholesky(matrix, n)
}

/// Solves `L Lᵀ X = B` in place for `columns` right-hand sides.
pub fn solve_cholesky(factor: &[f64], n: usize, right: &mut [f64], columns: usize) {
    if n > 0 && columns > 0 {
        library::solve_cholesky(factor, n, right, columns);
    }
}

/// `(L Lᵀ)⁻¹`, both triangles.
pub fn inverse_of_cholesky(factor: &[f64], n: usize) -> Vec<f64> {
    if n == 0 {
        return Vec::new();
    }
    let mut out = library::inverse_of_cholesky(factor, n);
    mirror_lower(&mut out, n);
    out
}

/// `C ← C − A A₁ᵀ` for some columns of a symmetric matrix of order n, from row `first` on, which is the first of the
/// columns as well; A₁ are the rows of A (n × k) that belong to them.
pub fn subtract_square(columns: &mut [f64], n: usize, first: usize, a: &[f64]) {
    if n > first && !columns.is_empty() && !a.is_empty() {
        library::subtract_square(columns, n, first, a);
    }
}

/// `A B` with A of order n, both column-major.
pub fn product(a: &[f64], n: usize, b: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; b.len()];
    if !out.is_empty() {
        library::product(a, n, b, &mut out);
    }
    out
}

/// Copies the lower triangle to the upper one.
pub fn mirror_lower(matrix: &mut [f64], n: usize) {
    for column in 0..n {
        for row in column + 1..n {
            matrix[row * n + column] = matrix[column * n + row];
        }
    }
}

/// `(Rᵀ R)⁻¹` of an upper triangular R (n × n, what lies below is ignored); `None` where a diagonal element is zero or the
/// inverse is not finite.
pub fn inverse_of_triangular(upper: &[f64], n: usize) -> Option<Vec<f64>> {
    if n == 0 {
        return Some(Vec::new());
    }
    if (0..n).any(|i| upper[i * n + i] == 0.0) || !finite(upper) {
        return None;
    }
    let inverse = library::inverse_of_upper(upper, n);
    let mut out = vec![0.0; n * n];
    for column in 0..n {
        for row in column..n {
            // Row `row` of R⁻¹ begins at its diagonal; row >= column.
            out[column * n + row] = (row..n).map(|k| inverse[k * n + row] * inverse[k * n + column]).sum();
        }
    }
    mirror_lower(&mut out, n);
    finite(&out).then_some(out)
}

/// Upper triangular factor R (`columns × columns`) of `rows × columns`, `rows >= columns`, whose memory is used up.
pub fn upper_factor(matrix: &mut [f64], rows: usize, columns: usize) -> Vec<f64> {
    let mut out = vec![0.0; columns * columns];
    if columns == 0 || rows < columns || !finite(matrix) {
        return out;
    }
    library::upper_factor(matrix, rows, columns);
    for column in 0..columns {
        out[column * columns..=column * columns + column]
            .copy_from_slice(&matrix[column * rows..=column * rows + column]);
    }
    out
}

/// Solves `R x = b` in place.
pub fn solve_upper(upper: &[f64], n: usize, right: &mut [f64]) {
    for row in (0..n).rev() {
        let known: f64 = (row + 1..n).map(|column| upper[column * n + row] * right[column]).sum();
        right[row] = (right[row] - known) / upper[row * n + row];
    }
}

/// Eigenvalues (ascending) and eigenvectors (columns) of a symmetric matrix; the lower triangle is read.
///
/// # Errors
/// [`Error::Decomposition`] where it does not converge, or an element is not finite.
pub fn symmetric_eigen(matrix: &[f64], n: usize) -> Result<(Vec<f64>, Vec<f64>)> {
    decompose("eigenvalue decomposition", library::symmetric_eigen, matrix, n)
}

/// Singular values (descending) and right singular vectors (columns) of a square matrix.
///
/// # Errors
/// [`Error::Decomposition`] where it does not converge, or an element is not finite.
pub fn singular_values(matrix: &[f64], n: usize) -> Result<(Vec<f64>, Vec<f64>)> {
    decompose("singular value decomposition", library::singular_values, matrix, n)
}

/// Values and vectors; nothing where the decomposition does not converge.
pub(crate) type Decomposition = Option<(Vec<f64>, Vec<f64>)>;

fn decompose(
    what: &'static str,
    work: impl FnOnce(&[f64], usize) -> Decomposition,
    matrix: &[f64],
    n: usize,
) -> Result<(Vec<f64>, Vec<f64>)> {
    if n == 0 {
        return Ok((Vec::new(), Vec::new()));
    }
    finite(matrix).then(|| work(matrix, n)).flatten().ok_or(Error::Decomposition { what })
}
