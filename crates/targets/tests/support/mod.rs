//! Simulated images of flat targets with the truth, for tests, benches and the comparison with other programs.
#![allow(dead_code)] // Each program uses its part.

pub mod board;
pub mod cases;
pub mod coded;
pub mod dots;
pub mod render;
pub mod sensor;
pub mod views;
