#![doc = include_str!("../README.md")]

mod decompositions;
mod error;
mod panel;
mod product;
#[cfg(feature = "faer")]
mod with_faer;
#[cfg(not(feature = "faer"))]
mod with_nalgebra;

pub use decompositions::{
    cholesky, inverse_of_cholesky, inverse_of_triangular, mirror_lower, product, singular_values, solve_cholesky,
    solve_upper, subtract_square, symmetric_eigen, upper_factor,
};
pub use error::Error;
use error::Result;
pub use panel::transposed;
pub use product::{Left, Right, add_product, with_wide_registers};
