//! A positive system of three equations.

#[allow(clippy::print_stdout)]
fn main() {
    let mut matrix = [4.0, 1.0, 0.0, 1.0, 3.0, 1.0, 0.0, 1.0, 2.0];
    let mut right = [1.0, 2.0, 3.0];
    if dense_matrices::cholesky(&mut matrix, 3) {
        dense_matrices::solve_cholesky(&matrix, 3, &mut right, 1);
        println!("{right:?}");
    }
}
