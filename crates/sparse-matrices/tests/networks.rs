//! Matrices of networks.

use sparse_matrices::BlockMatrix;

/// Numbers between −1 and 1 that follow no rule.
fn number(k: usize) -> f64 {
    ((k * 7919 + 13) as f64 * 0.618_034).sin()
}

/// A walk of `count` stations whose matrix couples each with the next ones, and returns beside itself after every `row`: as corridors
/// that lie beside each other. Every fifth block has a width of its own.
pub fn corridors(count: usize, row: usize) -> BlockMatrix {
    let widths: Vec<usize> = (0..count).map(|k| if k % 5 == 4 { 3 } else { 6 }).collect();
    let mut matrix = BlockMatrix::new(&widths);
    let mut pairs = Vec::new();
    for k in 0..count {
        pairs.extend([1, 2].into_iter().filter(|step| k + step < count).map(|step| (k, k + step)));
        // The station across in the next corridor.
        let across = k + 2 * (row - k % row) - 1;
        pairs.extend((across < count && across > k + 2).then_some((k, across)));
    }
    for (n, (a, b)) in pairs.into_iter().enumerate() {
        // The square of a row over both blocks, so that the sum is positive.
        for observation in 0..6 {
            let entry = |block: usize, k: usize| number(1000 * n + 100 * observation + 10 * (block % 2) + k);
            let both = [(a, 0), (b, 1)];
            for (first, x) in both {
                for (second, y) in both.into_iter().filter(|(second, _)| *second <= first) {
                    matrix.add(first, second, |i, j| entry(x, i) * entry(y, j));
                }
            }
        }
    }
    (0..matrix.order()).for_each(|row| matrix.add_to_diagonal(row, 1e-2));
    matrix
}
