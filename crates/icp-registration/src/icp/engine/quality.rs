//! What the pairs of a run say about the pose.

use nalgebra::{Matrix6, Vector6};

use crate::error::Result;
use crate::parts::Rows;
use crate::quality::{Cells, Verdict};
use crate::system::System;

/// Cells across the rms radius where distances of points are minimised: how far samples lie beside each other along the surface beats with
/// the grids of both frames, and is shared farther than errors across it.
const CELLS_OF_SAMPLES: f64 = 4.0;

/// Judges the pairs of `system`; motions with a predicted sigma above `max_sigma_m` are undetermined.
pub(in crate::icp) fn verdict(system: &System<'_>, max_sigma_m: f64) -> Result<Verdict> {
    let frame = system.frame();
    // On the way, a deviation that is rather too small keeps the iterations going.
    let at_the_end = system.scene().moment.ended;
    let per_radius = if at_the_end && system.is_point_to_point() { CELLS_OF_SAMPLES } else { Cells::PER_RADIUS };
    let mut cells = Cells::new(frame, frame.radius_m / per_radius);
    let mut buffers = [Rows::default(), Rows::default()];
    let twin_weight = system.twin_weight();
    for (i, pair) in system.pairs().iter().enumerate() {
        let score: Vector6<f64> = system.score(i, &mut buffers[0]);
        let slope = slope_along_normal(system, i, &mut buffers[0]);
        add_information(system, i, slope * twin_weight, &mut buffers, cells.add(&pair.moved, &score));
    }
    Verdict::new(&cells, max_sigma_m)
}

/// Slope of a pair's influence along its normal. The kernel takes weight along the residual alone: the slope of its
/// influence there, the weight itself across. Where the sampling of the surface makes most of the residual of two points,
/// little of that loss lies along the normal.
fn slope_along_normal(system: &System<'_>, i: usize, rows: &mut Rows) -> f64 {
    let (weight, slope) = system.weights(i);
    let pair = &system.pairs()[i];
    if !system.is_point_to_point() || pair.normal.x.is_nan() {
        return slope;
    }
    system.rows(pair, rows);
    let (mut along, mut square) = (0.0, 0.0);
    for (row, residual) in rows.as_slice().iter().zip(system.residuals(rows)) {
        along += residual * row.gradient.dot(&pair.normal);
        square += residual * residual;
    }
    if square > 0.0 { weight + (slope - weight) * along * along / square } else { slope }
}

/// Information of a pair: the symmetric products of its derivatives from independent measurements.
fn add_information(system: &System<'_>, i: usize, weight: f64, [a, b]: &mut [Rows; 2], information: &mut Matrix6<f64>) {
    let pair = &system.pairs()[i];
    system.twins(pair, a, b);
    for (row, twin) in a.as_slice().iter().zip(b.as_slice()) {
        let (row, twin) = (system.jacobian(pair, row), system.jacobian(pair, twin));
        information.ger(0.5 * weight, &row, &twin, 1.0);
        information.ger(0.5 * weight, &twin, &row, 1.0);
    }
}
