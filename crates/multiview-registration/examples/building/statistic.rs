//! Buildings of more and more stations: what a registration costs, and whether that leaves its bounds.

use std::error::Error;

use crate::plan::Camera;
use crate::{Figures, registered};

/// Sizes of the buildings; the largest is compared with the second.
const SIZES: [usize; 3] = [50, 100, 200];
/// Doubled from 100 to 200 stations, `n log n` grows by 2.30. Processor time on a busy machine scatters by some tenths.
const MOST_GROWTH: f64 = 2.8;
/// Megabyte a station.
const MOST_MB: f64 = 4.0;
/// Mean normalised squared error of poses against those before them, of which six are expected.
const SQUARES: [f64; 2] = [4.0, 9.0];

pub fn run() -> Result<(), Box<dyn Error>> {
    let mut all: Vec<Figures> = Vec::new();
    for count in SIZES {
        all.push(registered(count, 1, Camera { width: 160, height: 120 }, 0..count)?);
    }
    let [.., before, last] = all.as_slice() else { return Ok(()) };
    let growth = last.seconds / before.seconds;
    let pairs = last.pairs_tried as f64 / before.pairs_tried as f64;
    let filled = last.filled_blocks as f64 / before.filled_blocks as f64;
    println!(
        "from {} to {} stations: {growth:.2} times the processor time, {pairs:.2} times the pairs, {filled:.2} times the blocks",
        SIZES[1], SIZES[2]
    );
    let squares = last.squares_of_next;
    if growth.max(pairs).max(filled) > MOST_GROWTH {
        return Err("the effort grows faster than n log n".into());
    }
    if last.most_mb / SIZES[2] as f64 > MOST_MB {
        return Err(format!("{:.0} MB are more than {MOST_MB} a station", last.most_mb).into());
    }
    if !(SQUARES[0]..SQUARES[1]).contains(&squares) {
        return Err(format!("normalised squared errors of {squares:.2} where 6 are expected").into());
    }
    Ok(())
}
