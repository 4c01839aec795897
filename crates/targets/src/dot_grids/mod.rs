//! Grids of dots: lattices among the discs of an image, and how they lie on the board.

mod centres;
mod find;
mod grid;
mod labelling;
mod lattices;
mod sizes;

pub use find::find_circle_grid;
pub use grid::{CircleGrid, CircleGridOptions};
