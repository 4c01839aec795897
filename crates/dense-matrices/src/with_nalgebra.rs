//! The decompositions by nalgebra, which is there anyway: column by column, for small problems.

use nalgebra::{Cholesky, DMatrix, DMatrixView, DMatrixViewMut, SVD, SymmetricEigen};

use crate::decompositions::Decomposition;

/// Rotations for each row, ten times what is usual: a decomposition that does not converge is told.
const ROUNDS: usize = 30;

pub(crate) fn cholesky(matrix: &mut [f64], n: usize) -> bool {
    let factor = Cholesky::new(DMatrix::from_column_slice(n, n, matrix));
    factor.map(|factor| matrix.copy_from_slice(factor.unpack_dirty().as_slice())).is_some()
}

pub(crate) fn solve_cholesky(factor: &[f64], n: usize, right: &mut [f64], columns: usize) {
    let factor = DMatrixView::from_slice(factor, n, n);
    let mut right = DMatrixViewMut::from_slice(right, n, columns);
    // The diagonal of a Cholesky factor is positive: both can be solved.
    factor.solve_lower_triangular_unchecked_mut(&mut right);
    factor.tr_solve_lower_triangular_unchecked_mut(&mut right);
}

pub(crate) fn inverse_of_cholesky(factor: &[f64], n: usize) -> Vec<f64> {
    Cholesky::pack_dirty(DMatrix::from_column_slice(n, n, factor)).inverse().data.into()
}

pub(crate) fn inverse_of_upper(upper: &[f64], n: usize) -> Vec<f64> {
    let mut out = DMatrix::identity(n, n);
    DMatrixView::from_slice(upper, n, n).solve_upper_triangular_unchecked_mut(&mut out);
    out.data.into()
}

pub(crate) fn subtract_square(columns: &mut [f64], n: usize, first: usize, a: &[f64]) {
    let count = columns.len() / n;
    let a = DMatrixView::from_slice(a, n, a.len() / n);
    let right = a.rows(first, count).transpose();
    let mut out = DMatrixViewMut::from_slice(columns, n, count);
    out.rows_mut(first, n - first).gemm(-1.0, &a.rows(first, n - first), &right, 1.0);
}

pub(crate) fn product(a: &[f64], n: usize, b: &[f64], out: &mut [f64]) {
    let columns = b.len() / n;
    let (a, b) = (DMatrixView::from_slice(a, n, n), DMatrixView::from_slice(b, n, columns));
    DMatrixViewMut::from_slice(out, n, columns).gemm(1.0, &a, &b, 0.0);
}

/// R in place of the upper triangle.
pub(crate) fn upper_factor(matrix: &mut [f64], rows: usize, columns: usize) {
    let upper = DMatrix::from_column_slice(rows, columns, matrix).qr().unpack_r();
    for column in 0..columns {
        matrix[column * rows..=column * rows + column].copy_from_slice(&upper.column(column).as_slice()[..=column]);
    }
}

pub(crate) fn symmetric_eigen(matrix: &[f64], n: usize) -> Decomposition {
    let found = SymmetricEigen::try_new(DMatrix::from_column_slice(n, n, matrix), f64::EPSILON, ROUNDS * n)?;
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| found.eigenvalues[a].total_cmp(&found.eigenvalues[b]));
    let vectors = order.iter().flat_map(|&index| found.eigenvectors.column(index).iter().copied().collect::<Vec<_>>());
    Some((order.iter().map(|&index| found.eigenvalues[index]).collect(), vectors.collect()))
}

pub(crate) fn singular_values(matrix: &[f64], n: usize) -> Decomposition {
    let found = SVD::try_new(DMatrix::from_column_slice(n, n, matrix), false, true, f64::EPSILON, ROUNDS * n)?;
    let vectors = found.v_t?.transpose();
    Some((found.singular_values.as_slice().to_vec(), vectors.data.into()))
}
