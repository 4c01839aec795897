//! Pictures of what differs from pixel to pixel.

use super::picture::{Scale, raster_figure};
use crate::Result;
use crate::figure::Figure;
use crate::figure::canvas::Axes;
use crate::figure::chart::{Series, histogram};
use crate::figure::colour::{CATEGORIES, ColourMap};
use statistics::quantile;

/// Offsets of the pixels of an image, row by row, with their standard deviations, metre: both as pictures, and a histogram of
/// the offsets. A pixel whose standard deviation is NaN has none.
///
/// # Errors
/// [`Error::Picture`](crate::Error::Picture) where the offsets fill no whole rows of `width`.
pub fn pattern_figures(width: usize, offset_m: &[f32], sigma_m: &[f32]) -> Result<Vec<Figure>> {
    let known = |index: usize| sigma_m[index].is_finite();
    let plane = |values: &[f32]| -> Vec<f64> {
        let value = |(index, value): (usize, &f32)| if known(index) { 1e3 * f64::from(*value) } else { f64::NAN };
        values.iter().enumerate().map(value).collect()
    };
    let [offsets, deviations] = [plane(offset_m), plane(sigma_m)];
    let most = |values: &[f64]| {
        let wide = quantile(&mut values.iter().map(|value| value.abs()).collect::<Vec<f64>>(), 0.98);
        if wide > 0.0 { wide } else { 1.0 }
    };
    let high = most(&offsets);
    let signed = Scale { map: ColourMap::Diverging, low: -high, high, unit: "mm" };
    let positive = Scale { map: ColourMap::Sequential, low: 0.0, high: most(&deviations), unit: "mm" };
    let axes = Axes { title: "Offsets", x: "offset, mm", y: "percent of the pixels" };
    let set = Series { name: "pixels", colour: CATEGORIES[0], values: offsets.clone() };
    Ok(vec![
        raster_figure("Offset", width, &offsets, &signed)?.caption("Grey: no wall shows the pixel."),
        raster_figure("Standard deviation", width, &deviations, &positive)?,
        histogram(&axes, [-high, high], &[set]),
    ])
}
