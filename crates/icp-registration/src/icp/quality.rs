//! What the pairs of a run say about the pose.

use nalgebra::{Matrix6, Vector6};

use super::system::System;
use crate::error::Result;
use crate::parts::Rows;
use crate::quality::{Cells, Centred, Residuals, Verdict};

/// Cells across the rms radius of the pairs.
const CELLS_PER_RADIUS: f64 = 8.0;

/// Judges the pairs of `system`; motions with a predicted sigma above `max_sigma_m` are undetermined.
pub(super) fn verdict(system: &System<'_>, max_sigma_m: f64, residuals: Residuals) -> Result<Verdict> {
    let frame = Centred { centre: system.centre(), radius_m: system.radius_m() };
    let mut cells = Cells::new(frame, system.radius_m() / CELLS_PER_RADIUS);
    let mut buffers = [Rows::default(), Rows::default()];
    let twin_weight = system.twin_weight();
    for (i, pair) in system.pairs().iter().enumerate() {
        let score: Vector6<f64> = system.score(i, &mut buffers[0]);
        let (_, slope) = system.weights(i);
        add_information(system, i, slope * twin_weight, &mut buffers, cells.add(&pair.moved, &score));
    }
    Verdict::new(&cells, max_sigma_m, residuals)
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
