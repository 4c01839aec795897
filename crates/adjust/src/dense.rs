//! Guarded doors to faer's dense decompositions. Matrices are column-major slices; always one thread, so that the same
//! input gives the same bits everywhere; sizes of zero and values that are not finite never reach faer.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::linalg::evd::{self, ComputeEigenvectors};
use faer::linalg::matmul::matmul;
use faer::linalg::qr::no_pivoting::factor as qr;
use faer::linalg::svd::{self, ComputeSvdVectors};
use faer::linalg::{triangular_inverse, triangular_solve};
use faer::{Accum, Mat, MatMut, MatRef, Par, Spec};

use crate::{Error, Result};

fn finite(matrix: &[f64]) -> bool {
    matrix.iter().all(|value| value.is_finite())
}

/// `A = L Lᵀ` in place, lower triangle only. False where a pivot is not positive: then A is not usable.
#[must_use]
pub(crate) fn cholesky(matrix: &mut [f64], n: usize) -> bool {
    if n == 0 {
        return true;
    }
    if !finite(matrix) {
        return false;
    }
    let scratch = llt::factor::cholesky_in_place_scratch::<f64>(n, Par::Seq, Spec::default());
    llt::factor::cholesky_in_place(
        MatMut::from_column_major_slice_mut(matrix, n, n),
        llt::factor::LltRegularization::default(),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        Spec::default(),
    )
    .is_ok()
}

/// Solves `L Lᵀ X = B` in place for `columns` right-hand sides.
pub(crate) fn solve_cholesky(factor: &[f64], n: usize, right: &mut [f64], columns: usize) {
    if n == 0 || columns == 0 {
        return;
    }
    let factor = MatRef::from_column_major_slice(factor, n, n);
    let mut right = MatMut::from_column_major_slice_mut(right, n, columns);
    triangular_solve::solve_lower_triangular_in_place(factor, right.as_mut(), Par::Seq);
    triangular_solve::solve_upper_triangular_in_place(factor.transpose(), right, Par::Seq);
}

/// `(L Lᵀ)⁻¹`, both triangles.
pub(crate) fn inverse_of_cholesky(factor: &[f64], n: usize) -> Vec<f64> {
    let mut out = vec![0.0; n * n];
    if n == 0 {
        return out;
    }
    let scratch = llt::inverse::inverse_scratch::<f64>(n, Par::Seq);
    llt::inverse::inverse(
        MatMut::from_column_major_slice_mut(&mut out, n, n),
        MatRef::from_column_major_slice(factor, n, n),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
    );
    mirror_lower(&mut out, n);
    out
}

/// `C ← C − A A₁ᵀ` for some columns of a symmetric matrix of order n, from row `first` on, which is the first of the
/// columns as well; A₁ are the rows of A (n × k) that belong to them.
pub(crate) fn subtract_square(columns: &mut [f64], n: usize, first: usize, a: &[f64]) {
    let (count, inner) = (columns.len() / n.max(1), a.len() / n.max(1));
    if count == 0 || inner == 0 {
        return;
    }
    let a = MatRef::from_column_major_slice(a, n, inner);
    let out = MatMut::from_column_major_slice_mut(columns, n, count).subrows_mut(first, n - first);
    let right = a.subrows(first, count).transpose();
    matmul(out, Accum::Add, a.subrows(first, n - first), right, -1.0, Par::Seq);
}

/// `A B` with A of order n, both column-major.
pub(crate) fn product(a: &[f64], n: usize, b: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; b.len()];
    let columns = b.len() / n.max(1);
    if columns > 0 {
        let a = MatRef::from_column_major_slice(a, n, n);
        let b = MatRef::from_column_major_slice(b, n, columns);
        let target = MatMut::from_column_major_slice_mut(&mut out, n, columns);
        matmul(target, Accum::Replace, a, b, 1.0, Par::Seq);
    }
    out
}

/// Copies the lower triangle to the upper one.
pub(crate) fn mirror_lower(matrix: &mut [f64], n: usize) {
    for column in 0..n {
        for row in column + 1..n {
            matrix[row * n + column] = matrix[column * n + row];
        }
    }
}

/// Replaces an upper triangular R (n × n, what lies below is ignored) by `(Rᵀ R)⁻¹`; `None` where a diagonal element is
/// zero or the inverse is not finite.
pub(crate) fn inverse_of_triangular(upper: &[f64], n: usize) -> Option<Vec<f64>> {
    if n == 0 {
        return Some(Vec::new());
    }
    if (0..n).any(|i| upper[i * n + i] == 0.0) || !finite(upper) {
        return None;
    }
    let mut inverse = Mat::<f64>::zeros(n, n);
    let upper = MatRef::from_column_major_slice(upper, n, n);
    triangular_inverse::invert_upper_triangular(inverse.as_mut(), upper, Par::Seq);
    let mut out = vec![0.0; n * n];
    for column in 0..n {
        for row in column..n {
            // Row `row` of R⁻¹ begins at its diagonal; row >= column.
            out[column * n + row] = (row..n).map(|k| inverse[(row, k)] * inverse[(column, k)]).sum();
        }
    }
    mirror_lower(&mut out, n);
    finite(&out).then_some(out)
}

/// Upper triangular factor R (`columns × columns`) of `rows × columns`, `rows >= columns`, whose memory is used up.
pub(crate) fn upper_factor(matrix: &mut [f64], rows: usize, columns: usize) -> Vec<f64> {
    let mut out = vec![0.0; columns * columns];
    if columns == 0 || rows < columns || !finite(matrix) {
        return out;
    }
    let block = qr::recommended_block_size::<f64>(rows, columns);
    let mut coefficients = Mat::<f64>::zeros(block, columns);
    let scratch = qr::qr_in_place_scratch::<f64>(rows, columns, block, Par::Seq, Spec::default());
    qr::qr_in_place(
        MatMut::from_column_major_slice_mut(matrix, rows, columns),
        coefficients.as_mut(),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        Spec::default(),
    );
    for column in 0..columns {
        out[column * columns..=column * columns + column]
            .copy_from_slice(&matrix[column * rows..=column * rows + column]);
    }
    out
}

/// Solves `R x = b` in place.
pub(crate) fn solve_upper(upper: &[f64], n: usize, right: &mut [f64]) {
    for row in (0..n).rev() {
        let known: f64 = (row + 1..n).map(|column| upper[column * n + row] * right[column]).sum();
        right[row] = (right[row] - known) / upper[row * n + row];
    }
}

/// Eigenvalues (ascending) and eigenvectors (columns) of a symmetric matrix; the lower triangle is read.
pub(crate) fn symmetric_eigen(matrix: &[f64], n: usize) -> Result<(Vec<f64>, Vec<f64>)> {
    let failed = Error::Decomposition { what: "eigenvalue decomposition" };
    if n == 0 {
        return Ok((Vec::new(), Vec::new()));
    }
    if !finite(matrix) {
        return Err(failed);
    }
    let (mut values, mut vectors) = (faer::diag::Diag::<f64>::zeros(n), vec![0.0; n * n]);
    let scratch = evd::self_adjoint_evd_scratch::<f64>(n, ComputeEigenvectors::Yes, Par::Seq, Spec::default());
    evd::self_adjoint_evd(
        MatRef::from_column_major_slice(matrix, n, n),
        values.as_mut(),
        Some(MatMut::from_column_major_slice_mut(&mut vectors, n, n)),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        Spec::default(),
    )
    .map_err(|_| failed)?;
    Ok((values.column_vector().iter().copied().collect(), vectors))
}

/// Singular values (descending) and right singular vectors (columns) of a square matrix.
pub(crate) fn singular_values(matrix: &[f64], n: usize) -> Result<(Vec<f64>, Vec<f64>)> {
    let failed = Error::Decomposition { what: "singular value decomposition" };
    if n == 0 {
        return Ok((Vec::new(), Vec::new()));
    }
    if !finite(matrix) {
        return Err(failed);
    }
    let (mut values, mut vectors) = (faer::diag::Diag::<f64>::zeros(n), vec![0.0; n * n]);
    let (no, yes) = (ComputeSvdVectors::No, ComputeSvdVectors::Full);
    let scratch = svd::svd_scratch::<f64>(n, n, no, yes, Par::Seq, Spec::default());
    svd::svd(
        MatRef::from_column_major_slice(matrix, n, n),
        values.as_mut(),
        None,
        Some(MatMut::from_column_major_slice_mut(&mut vectors, n, n)),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        Spec::default(),
    )
    .map_err(|_| failed)?;
    Ok((values.column_vector().iter().copied().collect(), vectors))
}
