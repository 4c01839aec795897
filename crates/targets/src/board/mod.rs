//! Checkerboards: saddles of the image, the lattice that they make, its place on the board, corners by least squares.

mod assembly;
mod checkerboard;
mod choice;
mod corners;
mod find;
mod labels;
mod saddles;
mod sides;
mod smoothness;

pub use checkerboard::{Checkerboard, CheckerboardOptions};
pub use find::find_checkerboard;
