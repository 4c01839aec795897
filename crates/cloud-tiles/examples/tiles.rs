//! A PLY into an octree: `cargo run --example tiles cloud.ply cloud.copc.laz [POINTS_IN_MEMORY]`.
#![allow(clippy::print_stdout)]

use cloud_tiles::{TileOptions, write_tiles};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [from, to, rest @ ..] = words.as_slice() else { return Err("name a PLY file and a .copc.laz file".into()) };
    let mut options = TileOptions::default();
    if let Some(points) = rest.first() {
        options.points_in_memory = points.parse()?;
    }
    let tiles = write_tiles(from, to, &options)?;
    println!("{} points in {} nodes, to {} m; {} left out", tiles.points, tiles.nodes, tiles.step_m, tiles.left_out);
    Ok(())
}
