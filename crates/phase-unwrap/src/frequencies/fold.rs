//! Where a camera folds its ranges: values lie in `[fold, fold + U)`, and an offset correction moves the fold from zero.

use std::f64::consts::TAU;

use range_image::Raster;

use crate::{Error, Result};

/// Share of the pixels that may lie outside one interval before the ranges count as unwrapped already. A choice: a
/// larger one takes frames unwrapped before for wrapped ones that err.
const OUTLIER_SHARE: f64 = 1e-3;
/// Share of the interval by which corrections after the fold may have blurred its ends. A choice: corrections of ranges
/// are some centimetres of an interval of metres; pixels beyond are masked.
const BLUR: f64 = 0.02;

/// Where the camera's ranges begin.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Fold {
    /// From the ranges themselves: the place nearest to zero that leaves them in one interval.
    #[default]
    Detect,
    /// At this range in metres: the camera's offset.
    At(f64),
}

/// Where the fold lies; `None` where the ranges span more than one interval: something has unwrapped them already.
pub(crate) fn locate(
    range_m: &Raster<f32>,
    mask: Option<&Raster<bool>>,
    interval_m: f64,
    fold: Fold,
) -> Result<Option<f64>> {
    if !(interval_m.is_finite() && interval_m > 0.0) {
        let expected = "positive and finite";
        return Err(Error::OutOfDomain { name: "interval_m", value: interval_m, expected });
    }
    let mut values = used_values(range_m, mask);
    if values.is_empty() {
        return Err(Error::AllMasked { pixels: range_m.len() });
    }
    values.sort_unstable_by(f64::total_cmp);
    let outliers = (OUTLIER_SHARE * values.len() as f64) as usize;
    let (last, blur) = (values.len() - 1, BLUR * interval_m);
    match fold {
        Fold::At(start) if start.is_finite() => {
            let below = values.partition_point(|&value| value < start - blur);
            let above = values.len() - values.partition_point(|&value| value < start + interval_m + blur);
            Ok((below + above <= outliers).then_some(start))
        }
        Fold::At(value) => Err(Error::OutOfDomain { name: "fold", value, expected: "finite" }),
        Fold::Detect => {
            let span = |cut: usize| (values[last - cut] - interval_m, values[cut]);
            let within = |(highest, lowest): &(f64, f64)| highest - lowest <= blur;
            // Half of the outliers on each side, and only where they are needed.
            let ends = [0, outliers / 2].map(span).into_iter().find(within);
            Ok(ends.map(|(start, end)| if start < end { 0.0_f64.clamp(start, end) } else { f64::midpoint(start, end) }))
        }
    }
}

fn used_values(range_m: &Raster<f32>, mask: Option<&Raster<bool>>) -> Vec<f64> {
    let used = |index: usize| mask.is_none_or(|mask| mask.as_slice()[index]);
    let values = range_m.as_slice().iter().enumerate().filter(|(index, value)| value.is_finite() && used(*index));
    values.map(|(_, &value)| f64::from(value)).collect()
}

/// The phase that the camera measured, in `[0, 2 pi]`; NaN where a range lies outside the interval by more than blur.
pub(crate) fn phase_from_folded(range_m: &Raster<f32>, interval_m: f64, fold_m: f64) -> Raster<f32> {
    range_m.map(|&range| {
        let cycles = (f64::from(range) - fold_m) / interval_m;
        let inside = (-BLUR..=1.0 + BLUR).contains(&cycles);
        if inside { ((cycles.clamp(0.0, 1.0) * TAU) as f32).min(std::f32::consts::TAU) } else { f32::NAN }
    })
}
