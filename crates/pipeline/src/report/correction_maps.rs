//! Pictures of what each group of range terms did to a view.

use super::colour::ColourMap;
use super::picture::{Scale, raster_figure};
use crate::statistics::quantile;
use crate::view::View;
use crate::{Error, Result};

/// One picture for each group of terms that differs from pixel to pixel, in millimetres, all on one scale; what is the
/// same everywhere stands in the caption. Nothing where the ranges were not corrected.
pub(super) fn correction_maps(view: &View) -> Result<Vec<(String, String)>> {
    let Some(record) = &view.correction else { return Ok(Vec::new()) };
    let maps = record.maps().map_err(|error| Error::Figure {
        figure: format!("range terms of {}", view.name()),
        message: error.to_string(),
    })?;
    let mut groups: Vec<(&str, Vec<f64>)> = Vec::new();
    for (term, map) in &maps {
        let change = map.as_slice().iter().map(|metres| 1e3 * f64::from(*metres));
        match groups.iter_mut().find(|(name, _)| *name == term.group()) {
            Some((_, sum)) => sum.iter_mut().zip(change).for_each(|(sum, change)| *sum += change),
            None => groups.push((term.group(), change.collect())),
        }
    }
    let constant = groups.iter().find(|(name, _)| *name == "offset").and_then(|(_, map)| largest(map));
    groups.retain(|(name, _)| *name != "offset");
    let mut all: Vec<f64> = groups.iter().flat_map(|(_, map)| map.iter().map(|change| change.abs())).collect();
    let limit = quantile(&mut all, 0.99);
    let limit = if limit.is_finite() { limit.max(0.1) } else { 0.1 };
    let scale = Scale { map: ColourMap::Diverging, low: -limit, high: limit, unit: "mm" };
    let of_first = if record.frequencies() > 1 { " Of the first frequency." } else { "" };
    let (width, _) = view.size();
    let figure = |(index, (name, map)): (usize, &(&str, Vec<f64>))| {
        let offset = constant.filter(|_| index == 0).map_or_else(String::new, |offset| {
            format!(" Besides, the offset d0 moved every corrected pixel by {offset:+.2} mm.")
        });
        let most = largest(map).unwrap_or(0.0);
        let caption = format!("New minus old range; the largest change is {most:+.2} mm.{of_first}{offset}");
        Ok((raster_figure(&format!("Correction: {name}"), width, map, &scale)?, caption))
    };
    groups.iter().enumerate().map(figure).collect()
}

/// The value of largest magnitude.
fn largest(map: &[f64]) -> Option<f64> {
    map.iter().copied().filter(|value| value.is_finite()).max_by(|a, b| a.abs().total_cmp(&b.abs()))
}
