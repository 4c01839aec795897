#![doc = include_str!("../README.md")]

mod psf;

pub use psf::{GaussianTerm, Psf};
