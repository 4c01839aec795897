//! How much an unwrapped surface bends: what tells wrap counts of one phase image from each other.

use std::f32::consts::{PI, TAU};

use range_image::Raster;

/// Side of the blocks whose means are compared, in pixels. Counts that were bent to smooth each pixel's noise look better
/// than the truth from pixel to pixel; over blocks they do not. Blocks of three pixels choose alike, and see less of fine
/// structure.
const SIDE: usize = 2;

/// Sum of the squared second differences between means of neighbouring blocks, along columns and rows, each bounded by
/// the square of half a cycle: a jump costs the same however many cycles it has. Blocks with a masked pixel are left out.
pub(crate) fn bends(phase: &Raster<f32>, wraps: &Raster<i32>) -> f64 {
    let (width, height) = (phase.width() / SIDE, phase.height() / SIDE);
    let unwrapped = |at: (usize, usize)| phase[at] + TAU * wraps[at] as f32;
    let mean = |row: usize| {
        (0..width).map(move |col| {
            let pixels = (0..SIDE * SIDE).map(|n| unwrapped((SIDE * col + n % SIDE, SIDE * row + n / SIDE)));
            pixels.sum::<f32>() / (SIDE * SIDE) as f32
        })
    };
    let mut rows: [Vec<f32>; 3] = Default::default();
    let mut sum = 0.0;
    for row in 0..height {
        rows.rotate_left(1);
        rows[2].clear();
        rows[2].extend(mean(row));
        sum += rows[2].windows(3).map(|w| bend(w[0], w[1], w[2])).sum::<f64>();
        let above = rows[0].iter().zip(&rows[1]).zip(&rows[2]);
        sum += above.map(|((above, here), below)| bend(*above, *here, *below)).sum::<f64>();
    }
    sum
}

/// Zero where a mean is not known.
fn bend(before: f32, here: f32, after: f32) -> f64 {
    let difference = (after - here) - (here - before);
    if difference.is_nan() { 0.0 } else { f64::from(difference.abs().min(PI)).powi(2) }
}
