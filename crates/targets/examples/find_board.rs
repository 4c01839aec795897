//! Finds a checkerboard in an image: `find_board IMAGE COLUMNS ROWS`; without arguments in one that it draws.
#![allow(clippy::print_stdout)]

use range_image::Raster;
use targets::{Checkerboard, CheckerboardOptions, find_checkerboard};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (image, board) = if let [path, columns, rows] = &arguments[..] {
        (range_io::grey::read(path)?, Checkerboard::new(columns.parse()?, rows.parse()?, 1.0)?)
    } else {
        (drawn(), Checkerboard::new(9, 6, 1.0)?)
    };
    let seen = find_checkerboard(&image, &board, &CheckerboardOptions::default())?;
    println!("{} nodes, labelings that look the same: {}", seen.nodes.len(), seen.ambiguity);
    for node in &seen.nodes {
        let sigma = node.point.covariance.diagonal().map(f64::sqrt);
        let ([i, j], [col, row]) = (node.node, node.point.pixel);
        println!("node {i} {j}  col {col:8.3}  row {row:8.3}  sigma {:.3} {:.3}", sigma.x, sigma.y);
    }
    Ok(())
}

/// A board of 9 x 6, fields of 14 pixels.
fn drawn() -> Raster<f32> {
    Raster::from_fn(200, 160, |col, row| {
        let inside = (30..170).contains(&col) && (30..128).contains(&row);
        let dark = inside && ((col - 30) / 14 + (row - 30) / 14) % 2 == 0;
        if dark { 30.0 } else { 200.0 }
    })
}
