//! A levelling line that closes: heights of a thousand points by the differences between them, and how well they are known.
//!
//! ```text
//! cargo run -p sparse-matrices --example walk
//! ```
#![allow(clippy::print_stdout)]

use sparse_matrices::BlockMatrix;

fn main() {
    let count = 1000;
    let mut normal = BlockMatrix::new(&vec![1; count]);
    let mut right = vec![0.0; count];
    for a in 0..count {
        // The difference to the next point is observed as 1 mm, that back to the first one likewise.
        let (b, observed) = ((a + 1) % count, 1e-3);
        normal.add_to_diagonal(a, 1.0);
        normal.add_to_diagonal(b, 1.0);
        normal.add(a.max(b), a.min(b), |_, _| -1.0);
        right[a] -= observed;
        right[b] += observed;
    }
    normal.add_to_diagonal(0, 1e6);
    let Some(factor) = normal.factor() else { return println!("the heights are not determined") };
    factor.solve(&mut right);
    let inverse = factor.selected_inverse();
    let middle = inverse.block(count / 2, count / 2).map_or(f64::NAN, |block| block[0].sqrt());
    println!("{} blocks are filled of {}", factor.filled(), count * (count + 1) / 2);
    println!(
        "the middle is known {middle:.2} times worse than a difference; {:.2} is expected",
        (count as f64).sqrt() / 2.0
    );
}
