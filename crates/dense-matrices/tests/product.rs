//! Products of small blocks.

use dense_matrices::{Left, Right, add_product};

#[test]
fn all_shapes_agree_with_the_definition() {
    for rows in [1, 2, 3, 5, 6, 9, 17] {
        for inner in [1, 2, 3, 4, 6, 9] {
            let columns = 4;
            let data: Vec<f64> = (0..inner * 20).map(|i| (f64::from(i) * 0.7).sin()).collect();
            let right: Vec<f64> = (0..inner * 5).map(|i| (f64::from(i) * 1.3).cos()).collect();
            let inner = inner as usize;
            let mut out = vec![1.0; columns * 21];
            let left = Left { data: &data, stride: 20, rows };
            let factors = Right { data: &right, inner: 5, column: 1, columns };
            add_product(&mut out, 21, left, factors, inner, -0.5);
            for j in 0..columns {
                for i in 0..21 {
                    let sum: f64 = (0..inner).map(|k| data[(k * 20 + i).min(data.len() - 1)] * right[k * 5 + j]).sum();
                    let expected = if i < rows { 1.0 - 0.5 * sum } else { 1.0 };
                    // Nine products of numbers below one.
                    assert!((out[j * 21 + i] - expected).abs() < 1e-14);
                }
            }
        }
    }
}

#[test]
fn slices_that_are_too_short_give_no_numbers() {
    let data = [1.0; 12];
    let whole = |out: usize, left: usize, right: usize| {
        let mut out = vec![1.0; out];
        let left = Left { data: &data[..left], stride: 3, rows: 3 };
        add_product(&mut out, 3, left, Right { data: &data[..right], inner: 2, column: 1, columns: 2 }, 4, 1.0);
        out.iter().all(|value| value.is_nan())
    };
    assert!(!whole(6, 12, 8));
    assert!(whole(5, 12, 8) && whole(6, 11, 8) && whole(6, 12, 7) && whole(2, 0, 0));
}
