//! Back from filtered phases to the measured ones: only the whole cycles are taken from the filter.

use std::f32::consts::TAU;

use range_image::Raster;

use crate::Result;

/// Wrap counts of the measured `phase` from the counts of its filtered version:
/// `wraps = round((filtered + 2 pi filtered_wraps - phase) / 2 pi)`.
///
/// `phase + 2 pi wraps` lies within pi of the unwrapped filtered surface and keeps every detail of the measurement. All
/// three rasters have the same size, phases are radians of any cycle; pixels without a finite phase get 0. A
/// difference of exactly half a cycle is rounded away from zero.
pub fn congruent(phase: &Raster<f32>, filtered: &Raster<f32>, filtered_wraps: &Raster<i32>) -> Result<Raster<i32>> {
    let mut wraps = filtered_wraps.clone();
    congruent_into(phase, filtered, &mut wraps)?;
    Ok(wraps)
}

/// As [`congruent`]; `wraps` holds the filtered phase's counts before and the measured phase's after.
pub fn congruent_into(phase: &Raster<f32>, filtered: &Raster<f32>, wraps: &mut Raster<i32>) -> Result<()> {
    phase.require_same_size(filtered, "filtered phase")?;
    phase.require_same_size(wraps, "wrap counts")?;
    for ((wraps, phase), filtered) in wraps.as_mut_slice().iter_mut().zip(phase.as_slice()).zip(filtered.as_slice()) {
        let cycles = (filtered - phase) / TAU;
        *wraps = if cycles.is_finite() { wraps.saturating_add(cycles.round() as i32) } else { 0 };
    }
    Ok(())
}
