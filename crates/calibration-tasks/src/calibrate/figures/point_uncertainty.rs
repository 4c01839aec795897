//! Maps of what the covariance of the calibration means for a point.

use nalgebra::DMatrix;
use pipeline::Result;
use report::{ColourMap, Figure, Scale, raster_figure};
use statistics::quantile;

use crate::calibrate::point_uncertainty::PointUncertainty;

/// Ranges of the maps, metre.
const RANGES_M: [f64; 3] = [1.0, 2.0, 4.0];
/// Columns of the maps; more would show the same smooth surface.
const COLUMNS: usize = 44;

/// Maps over the image of the standard deviation of a point, millimetre; empty where nothing was estimated.
pub(crate) fn figures(
    source: &PointUncertainty<'_>,
    names: &[String],
    covariance: &DMatrix<f64>,
    amplitude: f64,
) -> Result<Vec<(Figure, String)>> {
    let format = source.camera.format;
    let rows = (COLUMNS * format.height).div_ceil(format.width.max(1)).max(1);
    let centre = |index: usize, count: usize, pixels: usize| (index as f64 + 0.5) * pixels as f64 / count as f64 - 0.5;
    let moved = source.moved(names, covariance);
    if moved.is_empty() {
        return Ok(Vec::new());
    }
    let span = source.range_models.first().and_then(|(_, model)| model.range_span_m);
    let mut figures = Vec::new();
    for range_m in RANGES_M {
        let mut values = Vec::with_capacity(COLUMNS * rows);
        for row in 0..rows {
            for column in 0..COLUMNS {
                let pixel = [centre(column, COLUMNS, format.width), centre(row, rows, format.height)];
                values.push(1e3 * moved.at(pixel, range_m, amplitude).point_m);
            }
        }
        figures.push(figure(range_m, &values, span)?);
    }
    Ok(figures)
}

fn figure(range_m: f64, values: &[f64], span: Option<[f64; 2]>) -> Result<(Figure, String)> {
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    let high = finite().fold(0.0, f64::max);
    let scale = Scale { map: ColourMap::Sequential, low: 0.0, high, unit: "mm" };
    let svg = raster_figure(&format!("At {range_m} m"), COLUMNS, values, &scale)?;
    let outside = match span {
        Some([low, high]) if !(low..=high).contains(&range_m) => {
            format!(" Outside the ranges observed ({low:.2} m to {high:.2} m): extrapolated.")
        }
        _ => String::new(),
    };
    let caption =
        format!("Median {:.2} mm, at most {high:.2} mm.{outside}", quantile(&mut finite().collect::<Vec<_>>(), 0.5));
    Ok((svg, caption))
}
