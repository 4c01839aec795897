//! Factors and inverses against the matrices that they are of.

use dense_matrices::{
    Error, cholesky, inverse_of_cholesky, inverse_of_triangular, mirror_lower, product, singular_values,
    solve_cholesky, solve_upper, subtract_square, symmetric_eigen, upper_factor,
};

/// Sizes about the widths of registers and blocks.
const SIZES: [usize; 8] = [1, 2, 3, 4, 7, 16, 33, 150];

/// Numbers between −1 and 1 without a pattern.
fn matrix(rows: usize, columns: usize) -> Vec<f64> {
    (0..rows * columns).map(|i| (1.0 + (i * i) as f64 * 0.618_034).sin()).collect()
}

/// `A B` or `Aᵀ B`, A with `rows` rows as it is stored.
fn multiplied(transposed: bool, a: &[f64], b: &[f64], rows: usize) -> Vec<f64> {
    let (width, inner) = if transposed { (a.len() / rows, rows) } else { (rows, a.len() / rows) };
    let element = |i: usize, k: usize| if transposed { a[i * rows + k] } else { a[k * rows + i] };
    let sum = |i: usize, column: &[f64]| (0..inner).map(|k| element(i, k) * column[k]).sum::<f64>();
    b.chunks_exact(inner).flat_map(|column| (0..width).map(move |i| sum(i, column))).collect()
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn identity(n: usize) -> Vec<f64> {
    (0..n * n).map(|i| f64::from(i % (n + 1) == 0)).collect()
}

/// `AᵀA + I`: its condition stays below a thousand.
fn positive(n: usize) -> Vec<f64> {
    let a = matrix(n, n);
    multiplied(true, &a, &a, n).iter().zip(identity(n)).map(|(a, one)| a + one).collect()
}

/// Roundings of sums of `n` products.
fn rounding(n: usize) -> f64 {
    32.0 * n as f64 * f64::EPSILON
}

#[test]
fn a_cholesky_factor_gives_the_matrix_its_solutions_and_its_inverse() {
    for n in SIZES {
        let (a, right) = (positive(n), matrix(n, 3));
        let mut factor = a.clone();
        // What lies above the diagonal is not read.
        (0..n * n).filter(|i| i / n > i % n).for_each(|i| factor[i] = 7.0);
        assert!(cholesky(&mut factor, n));
        let mut solution = right.clone();
        solve_cholesky(&factor, n, &mut solution, 3);
        assert!(distance(&multiplied(false, &a, &solution, n), &right) < n as f64 * rounding(n));
        let inverse = inverse_of_cholesky(&factor, n);
        assert!(distance(&multiplied(false, &a, &inverse, n), &identity(n)) < n as f64 * rounding(n));
        (0..n * n).filter(|i| i / n > i % n).for_each(|i| factor[i] = 0.0);
        let lower = multiplied(true, &factor, &identity(n), n);
        assert!(distance(&multiplied(true, &lower, &lower, n), &a) < n as f64 * rounding(n));
    }
}

#[test]
fn products_agree_with_the_definition() {
    for n in SIZES {
        let (a, b) = (positive(n), matrix(n, 5));
        assert!(distance(&product(&a, n, &b), &multiplied(false, &a, &b, n)) < n as f64 * rounding(n));
        let turned: Vec<f64> = (0..5 * n).map(|i| b[i % 5 * n + i / 5]).collect();
        let all = multiplied(false, &b, &turned, n);
        // Two panels, or one.
        let first = n / 2;
        let mut out = a.clone();
        let (left, right) = out.split_at_mut(first * n);
        subtract_square(left, n, 0, &b);
        subtract_square(right, n, first, &b);
        for (i, value) in out.iter().enumerate().filter(|(i, _)| i % n >= i / n) {
            assert!((value - (a[i] - all[i])).abs() < rounding(n), "{n} {i}");
        }
    }
    assert!(product(&[], 0, &[]).is_empty());
}

#[test]
fn what_is_not_positive_has_no_cholesky_factor() {
    assert!(!cholesky(&mut [1.0, 2.0, 2.0, 4.0 - 1e-9], 2));
    assert!(!cholesky(&mut [1.0, f64::NAN, f64::NAN, 1.0], 2));
    assert!(!cholesky(&mut [0.0], 1));
    assert!(cholesky(&mut [], 0));
}

#[test]
fn an_upper_factor_has_the_same_gram_matrix() {
    for n in SIZES {
        let rows = 2 * n + 1;
        let a = matrix(rows, n);
        let upper = upper_factor(&mut a.clone(), rows, n);
        assert!((0..n * n).all(|i| i % n <= i / n || upper[i] == 0.0));
        let gram = multiplied(true, &a, &a, rows);
        assert!(distance(&multiplied(true, &upper, &upper, n), &gram) < n as f64 * rounding(n));
        let inverse = inverse_of_triangular(&upper, n).unwrap();
        assert!(distance(&multiplied(false, &gram, &inverse, n), &identity(n)) < 1e-9);
    }
    // A column that is a multiple of another, and one of zeros.
    let upper = upper_factor(&mut [1.0, 2.0, 2.0, 2.0, 4.0, 4.0, 0.0, 0.0, 0.0], 3, 3);
    assert!((upper[0].abs() - 3.0).abs() < 1e-14 && upper[4].abs() < 1e-14 && upper[6..] == [0.0; 3]);
    assert!(inverse_of_triangular(&[0.0], 1).is_none());
}

#[test]
fn eigenvalues_ascend_with_their_vectors() {
    for n in SIZES {
        let a = positive(n);
        let mut lower = a.clone();
        (0..n * n).filter(|i| i / n > i % n).for_each(|i| lower[i] = 7.0);
        let (values, vectors) = symmetric_eigen(&lower, n).unwrap();
        assert!(values.is_sorted());
        let largest = values[n - 1];
        let scaled: Vec<f64> = vectors.iter().enumerate().map(|(i, v)| v * values[i / n]).collect();
        assert!(distance(&multiplied(false, &a, &vectors, n), &scaled) < largest * rounding(n));
        assert!(distance(&multiplied(true, &vectors, &vectors, n), &identity(n)) < rounding(n));
    }
    assert!(symmetric_eigen(&[f64::INFINITY], 1).is_err());
}

#[test]
fn singular_values_descend_with_their_vectors() {
    for n in SIZES {
        // Columns of ever smaller lengths, the last of zeros: the condition is that of a network without a datum.
        let shrink = |column: usize| if column + 1 == n { 0.0 } else { 10_f64.powf(-12.0 * column as f64 / n as f64) };
        let a: Vec<f64> = matrix(n, n).iter().enumerate().map(|(i, a)| a * shrink(i / n)).collect();
        let (values, vectors) = singular_values(&a, n).unwrap();
        assert!(values.is_sorted_by(|a, b| a >= b));
        assert!(distance(&multiplied(true, &vectors, &vectors, n), &identity(n)) < rounding(n));
        let turned = multiplied(false, &a, &vectors, n);
        for (column, value) in turned.chunks_exact(n).zip(&values) {
            let length = column.iter().map(|v| v * v).sum::<f64>().sqrt();
            assert!((length - value).abs() <= values[0] * rounding(n));
        }
        assert!(values[n - 1] <= values[0] * rounding(n));
    }
    assert!(singular_values(&[f64::NAN], 1).is_err());
}

#[test]
fn a_slice_that_is_too_short_gets_an_answer_without_numbers() {
    let all_nan = |values: &[f64]| values.iter().all(|value| value.is_nan());
    for n in [3, 40, usize::MAX] {
        let mut short = vec![1.0; 8];
        let mut right = vec![1.0; 8];
        assert!(!cholesky(&mut short, n) && inverse_of_triangular(&short, n).is_none());
        solve_cholesky(&short, n, &mut right, 2);
        assert!(all_nan(&right));
        assert!(all_nan(&inverse_of_cholesky(&short, n)) && all_nan(&product(&short, n, &[1.0; 6])));
        let mut right = vec![1.0; 8];
        solve_upper(&short, n, &mut right);
        assert!(all_nan(&right));
        assert_eq!(symmetric_eigen(&short, n), Err(Error::TooShort { n, found: 8 }));
        assert_eq!(singular_values(&short, n), Err(Error::TooShort { n, found: 8 }));
        assert!(upper_factor(&mut short, n, 3).is_empty());
        mirror_lower(&mut short, n);
        assert!(all_nan(&short));
    }
    let mut columns = vec![1.0; 8];
    subtract_square(&mut columns, 3, 0, &[1.0; 6]);
    assert!(all_nan(&columns));
    let mut columns = vec![1.0; 9];
    subtract_square(&mut columns, 3, 1, &[1.0; 6]);
    assert!(all_nan(&columns), "three columns from the second row on are too many");
    assert!(all_nan(&product(&[1.0; 9], 3, &[1.0; 4])));
}

#[test]
fn what_a_slice_holds_beyond_the_matrix_is_left_alone() {
    let (mut long, mut right) = (positive(3), matrix(3, 2));
    let (mut factor, mut solution) = (long.clone(), right.clone());
    assert!(cholesky(&mut factor, 3));
    solve_cholesky(&factor, 3, &mut solution, 2);
    long.push(f64::INFINITY);
    right.push(5.0);
    assert!(cholesky(&mut long, 3));
    solve_cholesky(&long, 3, &mut right, 2);
    assert_eq!((&long[..9], &right[..6], right[6]), (&factor[..], &solution[..], 5.0));
}
