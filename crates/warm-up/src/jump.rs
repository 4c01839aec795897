//! Whether the ranges jump: the scene or the camera was moved.

use crate::fitting::curve::Curve;
use crate::fitting::projection::{Basis, dot};
use crate::fitting::whitening::{Whitening, autocorrelation};
use crate::{DriftError, DriftResult};

/// Standard deviations of a step that no noise reaches: 4e-7 over 200 places.
const CERTAIN: f64 = 6.0;

/// Blocks at either end where a step and a fast transient are the same.
const END: usize = 3;

/// Refuses a step beside a curve that follows any drift.
///
/// The place is the one where a step explains most; its standard deviation is that beside the serial correlation of
/// what neither explains.
pub(crate) fn refuse_jump(curve: &Curve<'_>) -> DriftResult<()> {
    let plain = Whitening::new(curve.blocks, curve.length_s, 0.0);
    let Some((place, rest)) = best_step(curve, &plain) else { return Ok(()) };
    let whitening =
        Whitening::new(curve.blocks, curve.length_s, autocorrelation(&rest, curve.flexible(&plain).rank() + 1));
    let (basis, step) = (curve.flexible(&whitening), whitening.column(step(curve, place)));
    let observed = basis.residual(whitening.column(curve.observed()));
    let step = basis.residual(step);
    let square = dot(&step, &step);
    let size_m = dot(&step, &observed) / square;
    let rest: f64 = observed.iter().zip(&step).map(|(value, step)| (value - size_m * step).powi(2)).sum();
    let redundancy = curve.blocks.len() as f64 - basis.rank() as f64 - 1.0;
    let sigma_m = (rest / redundancy / square).sqrt();
    if size_m.abs() > CERTAIN * sigma_m {
        let time_s = f64::midpoint(curve.blocks[place - 1].time_s, curve.blocks[place].time_s);
        return Err(DriftError::Jump { time_s, size_m, sigma_m });
    }
    Ok(())
}

/// One from a block on, zero before.
fn step(curve: &Curve<'_>, place: usize) -> impl Iterator<Item = f64> {
    (0..curve.blocks.len()).map(move |index| if index < place { 0.0 } else { 1.0 })
}

/// The block from which on a step explains most, and what is left beside it.
fn best_step(curve: &Curve<'_>, whitening: &Whitening) -> Option<(usize, Vec<f64>)> {
    let basis: Basis = curve.flexible(whitening);
    let observed = basis.residual(whitening.column(curve.observed()));
    let candidate = |place: usize| {
        let direction = basis.direction(whitening.column(step(curve, place)))?;
        Some((dot(&direction, &observed), place, direction))
    };
    let places = END..curve.blocks.len().saturating_sub(END - 1);
    let best = places.filter_map(candidate).max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))?;
    let (share, place, direction) = best;
    Some((place, observed.iter().zip(&direction).map(|(value, step)| value - share * step).collect()))
}
