//! Dots and their grid in pictures: `cargo run --release -p targets --example dot_grid -- COLUMNS ROWS ORIGIN_RATIO PICTURE.png ...`;
//! the ratio is 1 for a grid without a larger dot. Prints the points, or why there are none.
#![allow(clippy::print_stdout)]

use std::error::Error;
use std::time::Instant;

use targets::{CircleGrid, CircleGridOptions, find_circle_grid, find_circles};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [columns, rows, ratio, pictures @ ..] = arguments.as_slice() else {
        return Err("COLUMNS ROWS ORIGIN_RATIO PICTURE.png ...".into());
    };
    let plain = CircleGrid::symmetric(columns.parse()?, rows.parse()?, 1.0)?;
    let ratio: f64 = ratio.parse()?;
    let grid = if ratio > 1.0 { plain.with_origin_dot(ratio)? } else { plain };
    for path in pictures {
        let image = range_io::grey::read(path)?;
        let options = CircleGridOptions::default();
        let start = Instant::now();
        let circles = find_circles(&image, &options.circles)?;
        println!("picture {path} {} discs in {:.0} ms", circles.len(), start.elapsed().as_secs_f64() * 1e3);
        match find_circle_grid(&image, &grid, &options) {
            Ok(seen) => {
                println!("found {} ambiguity {} residual {:.3}", seen.nodes.len(), seen.ambiguity, seen.residual_px);
                for node in &seen.nodes {
                    let ([i, j], [col, row]) = (node.node, node.point.pixel);
                    println!("node {i} {j} {col:.4} {row:.4} {:.4}", node.point.covariance.trace().sqrt());
                }
            }
            Err(error) => println!("none: {error}"),
        }
    }
    Ok(())
}
