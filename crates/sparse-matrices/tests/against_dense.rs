//! Factor, solution and inverse against those of the whole matrix.

use nalgebra::{DMatrix, DVector};
use sparse_matrices::{BlockInverse, BlockMatrix, nalgebra};

use crate::networks::corridors;

fn dense(matrix: &BlockMatrix) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(matrix.order(), matrix.order());
    for row in 0..matrix.blocks() {
        for column in 0..matrix.blocks() {
            let block = matrix.block(row, column);
            out.view_mut((matrix.start(row), matrix.start(column)), block.shape()).copy_from(&block);
        }
    }
    out
}

#[test]
fn solutions_are_those_of_the_whole_matrix() {
    let matrix = corridors(60, 10);
    let whole = dense(&matrix);
    assert!((&whole - whole.transpose()).norm() < 1e-12 * whole.norm());
    let factor = matrix.factor().unwrap();
    let right = DVector::from_fn(matrix.order(), |k, _| (k as f64 * 0.37).cos());
    let expected = whole.clone().cholesky().unwrap().solve(&right);
    let mut found = right.clone();
    factor.solve(found.as_mut_slice());
    // Rounding at a condition of some thousands.
    assert!((&found - &expected).norm() < 1e-10 * expected.norm());
    let square = factor.inverse_square(right.as_slice());
    assert!((square - right.dot(&expected)).abs() < 1e-10 * square);
    let norm = matrix.norm(&vec![1.0; matrix.order()]);
    let largest = whole.column_iter().map(|column| column.lp_norm(1)).fold(0.0, f64::max);
    assert!((norm - largest).abs() < 1e-12 * largest);
}

#[test]
fn the_selected_inverse_is_the_inverse_where_it_is_known() {
    let matrix = corridors(60, 10);
    let inverse = dense(&matrix).try_inverse().unwrap();
    let factor = matrix.factor().unwrap();
    let selected = factor.selected_inverse();
    let mut known = 0;
    for row in 0..matrix.blocks() {
        for column in 0..matrix.blocks() {
            let Some(block) = selected.block(row, column) else { continue };
            known += 1;
            let expected = inverse.view((matrix.start(row), matrix.start(column)), block.shape());
            assert!((&block - expected).norm() < 1e-10 * inverse.norm(), "{row} {column}");
        }
        assert!(selected.block(row, row).is_some());
    }
    // Both triangles of what the factor holds.
    assert_eq!(known, 2 * factor.filled() - matrix.blocks());
    assert!(selected.block(0, 60).is_none());
    let all = BlockInverse::new(factor);
    assert!(all.selected(0, 31).is_none(), "stations far from each other");
    for (row, column) in [(0, 31), (4, 57), (3, 3)] {
        let block = all.block(row, column);
        let expected = inverse.view((matrix.start(row), matrix.start(column)), block.shape());
        assert!((&block - expected).norm() < 1e-10 * inverse.norm(), "{row} {column}");
    }
    let diagonal = DVector::from_vec(all.diagonal());
    assert!((diagonal - inverse.diagonal()).norm() < 1e-10 * inverse.norm());
}

#[test]
fn what_is_not_positive_has_no_factor() {
    let mut matrix = BlockMatrix::new(&[2, 2]);
    assert!(matrix.factor().is_none(), "zeros");
    (0..4).for_each(|row| matrix.add_to_diagonal(row, 1.0));
    assert!(matrix.factor().is_some());
    matrix.add(1, 0, |_, _| 2.0);
    assert!(matrix.factor().is_none(), "indefinite");
    matrix.add(1, 0, |_, _| f64::NAN);
    assert!(matrix.factor().is_none(), "not a number");
    assert!(BlockMatrix::new(&[]).factor().is_some_and(|factor| factor.order() == 0));
}

#[test]
fn slices_of_another_length_are_left_alone() {
    let factor = corridors(5, 10).factor().unwrap();
    let mut short = [1.0, 2.0];
    factor.solve(&mut short);
    assert!((short[0] - 1.0).abs() + (short[1] - 2.0).abs() < 1e-300);
    assert!(factor.inverse_square(&short).is_nan());
}

#[test]
fn a_matrix_that_is_cleared_keeps_its_blocks() {
    let mut matrix = corridors(12, 4);
    let filled = matrix.filled();
    matrix.clear();
    assert_eq!(matrix.filled(), filled);
    assert!(matrix.diagonal().iter().all(|value| value.abs() < 1e-300));
}
