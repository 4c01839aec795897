#![doc = include_str!("../README.md")]

mod copc;
mod error;
mod octree;
mod ply;
mod record;
mod tiles;

pub use error::{Error, Result};
pub use tiles::{FEWEST_POINTS_IN_MEMORY, TileOptions, Tiles, write_tiles};
