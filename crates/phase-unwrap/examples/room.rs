//! Unwraps a corridor with a bright card near the camera, and prints what became of it.
//!
//! `cargo run -p phase-unwrap --example room`
#![allow(clippy::print_stdout)]

use std::f32::consts::TAU;

use phase_unwrap::{ImageGeometry, SpatialOptions, unwrap_spatial};
use range_image::{Modulation, Raster};

const WIDTH: usize = 88;
const HEIGHT: usize = 72;
const PRINCIPAL_DISTANCE_PX: f32 = 100.0;

/// Range in metres of a corridor 2 m wide, 2.4 m high and 8 m long, with a card at 1 m; and the cosine of incidence.
fn scene(col: usize, row: usize) -> (f32, f32) {
    let x = (col as f32 - 43.5) / PRINCIPAL_DISTANCE_PX;
    let y = (row as f32 - 35.5) / PRINCIPAL_DISTANCE_PX;
    let norm = (1.0 + x * x + y * y).sqrt();
    if (50..66).contains(&col) && (30..46).contains(&row) {
        return (norm, 1.0 / norm);
    }
    let (end, side, floor) = (8.0, 1.0 / x.abs(), 1.2 / y.abs());
    if end < side && end < floor {
        (end * norm, 1.0 / norm)
    } else if side < floor {
        (side * norm, x.abs() / norm)
    } else {
        (floor * norm, y.abs() / norm)
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let modulation = Modulation::new(30e6)?;
    let range = Raster::from_fn(WIDTH, HEIGHT, |col, row| scene(col, row).0);
    let phase = range.map(|&r| (modulation.phase_from_range(r.into()) as f32).rem_euclid(TAU).min(TAU));
    let amplitude = Raster::from_fn(WIDTH, HEIGHT, |col, row| {
        let (range, cosine) = scene(col, row);
        500.0 * cosine / (range * range)
    });
    let geometry = ImageGeometry { principal_distance_px: PRINCIPAL_DISTANCE_PX, principal_point_px: [43.5, 35.5] };
    let options = SpatialOptions { geometry: Some(geometry), ..SpatialOptions::default() };
    let found = unwrap_spatial(&phase, Some(&amplitude), None, &options)?;

    println!("wrap counts; '?' where not sure:");
    for row in (0..HEIGHT).step_by(4) {
        let line = (0..WIDTH).step_by(2).map(|col| {
            let sure = found.confidence[(col, row)] >= options.minimum_confidence;
            if sure { found.wraps[(col, row)].to_string() } else { "?".to_owned() }
        });
        println!("{}", line.collect::<String>());
    }
    for (label, island) in found.islands.iter().enumerate() {
        println!("island {}: {island:?}", label + 1);
    }
    let interval = modulation.ambiguity_interval_m();
    let unwrapped = |col, row| interval * (f64::from(phase[(col, row)] / TAU) + f64::from(found.wraps[(col, row)]));
    println!(
        "end wall {:.3} m (is {:.3}), card {:.3} m (is {:.3})",
        unwrapped(44, 35),
        range[(44, 35)],
        unwrapped(58, 38),
        range[(58, 38)]
    );
    Ok(())
}
