//! Pictures of a fixed pattern.

use error_models::FixedPattern;
use report::{Axes, CATEGORIES, ColourMap, Figure, Scale, Series, histogram, raster_figure};

use crate::Result;
use crate::statistics::quantile;

/// Offsets, standard deviations and a histogram.
pub fn pattern_figures(pattern: &FixedPattern) -> Result<Vec<Figure>> {
    let known = |index: usize| pattern.sigma_m[index].is_finite();
    let plane = |values: &[f32]| -> Vec<f64> {
        let value = |(index, value): (usize, &f32)| if known(index) { 1e3 * f64::from(*value) } else { f64::NAN };
        values.iter().enumerate().map(value).collect()
    };
    let [offsets, deviations] = [plane(&pattern.offset_m), plane(&pattern.sigma_m)];
    let most = |values: &[f64]| {
        let mut sizes: Vec<f64> = values.iter().map(|value| value.abs()).collect();
        let wide = quantile(&mut sizes, 0.98);
        if wide > 0.0 { wide } else { 1.0 }
    };
    let high = most(&offsets);
    let signed = Scale { map: ColourMap::Diverging, low: -high, high, unit: "mm" };
    let positive = Scale { map: ColourMap::Sequential, low: 0.0, high: most(&deviations), unit: "mm" };
    let axes = Axes { title: "Offsets", x: "offset, mm", y: "percent of the pixels" };
    let set = Series { name: "pixels", colour: CATEGORIES[0], values: offsets.clone() };
    Ok(vec![
        raster_figure("Offset", pattern.width, &offsets, &signed)?.caption("Grey: no wall shows the pixel."),
        raster_figure("Standard deviation", pattern.width, &deviations, &positive)?,
        histogram(&axes, [-high, high], &[set]),
    ])
}
