//! The decompositions by faer: blocked, for thousands of unknowns.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::linalg::evd::{self, ComputeEigenvectors};
use faer::linalg::matmul::matmul;
use faer::linalg::qr::no_pivoting::factor as qr;
use faer::linalg::svd::{self, ComputeSvdVectors};
use faer::linalg::{triangular_inverse, triangular_solve};
use faer::{Accum, Mat, MatMut, MatRef, Par, Spec};

use crate::decompositions::Decomposition;

pub(crate) fn cholesky(matrix: &mut [f64], n: usize) -> bool {
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

pub(crate) fn solve_cholesky(factor: &[f64], n: usize, right: &mut [f64], columns: usize) {
    let factor = MatRef::from_column_major_slice(factor, n, n);
    let mut right = MatMut::from_column_major_slice_mut(right, n, columns);
    triangular_solve::solve_lower_triangular_in_place(factor, right.as_mut(), Par::Seq);
    triangular_solve::solve_upper_triangular_in_place(factor.transpose(), right, Par::Seq);
}

/// The lower triangle only.
pub(crate) fn inverse_of_cholesky(factor: &[f64], n: usize) -> Vec<f64> {
    let mut out = vec![0.0; n * n];
    let scratch = llt::inverse::inverse_scratch::<f64>(n, Par::Seq);
    llt::inverse::inverse(
        MatMut::from_column_major_slice_mut(&mut out, n, n),
        MatRef::from_column_major_slice(factor, n, n),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
    );
    out
}

pub(crate) fn inverse_of_upper(upper: &[f64], n: usize) -> Vec<f64> {
    let mut out = vec![0.0; n * n];
    triangular_inverse::invert_upper_triangular(
        MatMut::from_column_major_slice_mut(&mut out, n, n),
        MatRef::from_column_major_slice(upper, n, n),
        Par::Seq,
    );
    out
}

pub(crate) fn subtract_square(columns: &mut [f64], n: usize, first: usize, a: &[f64]) {
    let count = columns.len() / n;
    let a = MatRef::from_column_major_slice(a, n, a.len() / n);
    let out = MatMut::from_column_major_slice_mut(columns, n, count).subrows_mut(first, n - first);
    let right = a.subrows(first, count).transpose();
    matmul(out, Accum::Add, a.subrows(first, n - first), right, -1.0, Par::Seq);
}

pub(crate) fn product(a: &[f64], n: usize, b: &[f64], out: &mut [f64]) {
    let columns = b.len() / n;
    let (a, b) = (MatRef::from_column_major_slice(a, n, n), MatRef::from_column_major_slice(b, n, columns));
    matmul(MatMut::from_column_major_slice_mut(out, n, columns), Accum::Replace, a, b, 1.0, Par::Seq);
}

/// R in place of the upper triangle.
pub(crate) fn upper_factor(matrix: &mut [f64], rows: usize, columns: usize) {
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
}

pub(crate) fn symmetric_eigen(matrix: &[f64], n: usize) -> Decomposition {
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
    .ok()?;
    Some((values.column_vector().iter().copied().collect(), vectors))
}

pub(crate) fn singular_values(matrix: &[f64], n: usize) -> Decomposition {
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
    .ok()?;
    Some((values.column_vector().iter().copied().collect(), vectors))
}
