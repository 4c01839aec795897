//! Dense decompositions. Matrices are column-major slices; always one thread, so that the same input gives the same bits
//! everywhere; sizes of zero, slices that are too short and values that are not finite never reach the library that does the
//! work. What has no value is `false`, `None`, an error, or NaN.

#[cfg(feature = "faer")]
use crate::with_faer as library;
#[cfg(not(feature = "faer"))]
use crate::with_nalgebra as library;
use crate::{Error, Result};

/// The elements of a `rows × columns` matrix at the beginning of a slice; `None` where it is too short.
fn part(slice: &[f64], rows: usize, columns: usize) -> Option<&[f64]> {
    slice.get(..rows.checked_mul(columns)?)
}

/// As [`part`], to be written.
fn part_mut(slice: &mut [f64], rows: usize, columns: usize) -> Option<&mut [f64]> {
    slice.get_mut(..rows.checked_mul(columns)?)
}

fn finite(matrix: &[f64]) -> bool {
    matrix.iter().all(|value| value.is_finite())
}

/// `A = L Lᵀ` in place, lower triangle only. False where a pivot is not positive: then A is not usable. False as well
/// where the slice holds fewer than `n · n` elements.
#[must_use]
pub fn cholesky(matrix: &mut [f64], n: usize) -> bool {
    n == 0 || part_mut(matrix, n, n).is_some_and(|matrix| finite(matrix) && library::cholesky(matrix, n))
}

/// Solves `L Lᵀ X = B` in place for `columns` right-hand sides, one after another. `right` becomes NaN where it or the
/// factor is too short for `n` and `columns`.
pub fn solve_cholesky(factor: &[f64], n: usize, right: &mut [f64], columns: usize) {
    if n == 0 || columns == 0 {
        return;
    }
    match (part(factor, n, n), part_mut(right, n, columns)) {
        (Some(factor), Some(right)) => library::solve_cholesky(factor, n, right, columns),
        _ => right.fill(f64::NAN),
    }
}

/// `(L Lᵀ)⁻¹`, both triangles; as many NaN as the factor has elements where these are fewer than `n · n`.
pub fn inverse_of_cholesky(factor: &[f64], n: usize) -> Vec<f64> {
    if n == 0 {
        return Vec::new();
    }
    let Some(factor) = part(factor, n, n) else { return vec![f64::NAN; factor.len()] };
    let mut out = library::inverse_of_cholesky(factor, n);
    mirror_lower(&mut out, n);
    out
}

/// `C ← C − A A₁ᵀ` for some columns of a symmetric matrix of order n, from row `first` on, which is the first of the
/// columns as well; A₁ are the rows of A (n × k) that belong to them. The columns become NaN where there are more than
/// `n − first`, or a slice is no whole number of columns.
pub fn subtract_square(columns: &mut [f64], n: usize, first: usize, a: &[f64]) {
    if n <= first || columns.is_empty() || a.is_empty() {
        return;
    }
    if columns.len().is_multiple_of(n) && a.len().is_multiple_of(n) && columns.len() / n <= n - first {
        library::subtract_square(columns, n, first, a);
    } else {
        columns.fill(f64::NAN);
    }
}

/// `A B` with A of order n, both column-major; NaN where A is too short or B is no whole number of columns.
pub fn product(a: &[f64], n: usize, b: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; b.len()];
    match part(a, n, n) {
        _ if out.is_empty() => {}
        Some(a) if b.len().is_multiple_of(n) => library::product(a, n, b, &mut out),
        _ => out.fill(f64::NAN),
    }
    out
}

/// Copies the lower triangle to the upper one; all becomes NaN where the slice is too short.
pub fn mirror_lower(matrix: &mut [f64], n: usize) {
    if part(matrix, n, n).is_none() {
        return matrix.fill(f64::NAN);
    }
    for column in 0..n {
        for row in column + 1..n {
            matrix[row * n + column] = matrix[column * n + row];
        }
    }
}

/// `(Rᵀ R)⁻¹` of an upper triangular R (n × n, what lies below is ignored); `None` where a diagonal element is zero, the
/// inverse is not finite or the slice is too short.
pub fn inverse_of_triangular(upper: &[f64], n: usize) -> Option<Vec<f64>> {
    if n == 0 {
        return Some(Vec::new());
    }
    let upper = part(upper, n, n)?;
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

/// Upper triangular factor R (`columns × columns`) of `rows × columns`, `rows >= columns`, whose memory is used up. Zeros where
/// there are fewer rows than columns or an element is not finite; nothing where the slice is too short.
pub fn upper_factor(matrix: &mut [f64], rows: usize, columns: usize) -> Vec<f64> {
    let Some(matrix) = part_mut(matrix, rows, columns) else { return Vec::new() };
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

/// Solves `R x = b` in place; `right` becomes NaN where a slice is too short.
pub fn solve_upper(upper: &[f64], n: usize, right: &mut [f64]) {
    if part(upper, n, n).is_none() || right.len() < n {
        return right.fill(f64::NAN);
    }
    for row in (0..n).rev() {
        let known: f64 = (row + 1..n).map(|column| upper[column * n + row] * right[column]).sum();
        right[row] = (right[row] - known) / upper[row * n + row];
    }
}

/// Eigenvalues (ascending) and eigenvectors (columns) of a symmetric matrix; the lower triangle is read.
///
/// # Errors
/// [`Error::TooShort`] where the slice is; [`Error::Decomposition`] where it does not converge, or an element is not finite.
pub fn symmetric_eigen(matrix: &[f64], n: usize) -> Result<(Vec<f64>, Vec<f64>)> {
    decompose("eigenvalue decomposition", library::symmetric_eigen, matrix, n)
}

/// Singular values (descending) and right singular vectors (columns) of a square matrix.
///
/// # Errors
/// [`Error::TooShort`] where the slice is; [`Error::Decomposition`] where it does not converge, or an element is not finite.
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
    let Some(matrix) = part(matrix, n, n) else { return Err(Error::TooShort { n, found: matrix.len() }) };
    finite(matrix).then(|| work(matrix, n)).flatten().ok_or(Error::Decomposition { what })
}
