//! Pictures of what each group of range terms did to a view.

use report::{ColourMap, Figure, Scale, raster_figure};

use crate::survey::view::View;
use crate::{Error, Result};
use statistics::quantile;

/// One picture for each group of terms that differs from pixel to pixel, in millimetres, all on one scale; what is the
/// same everywhere stands in the caption. Nothing where the ranges were not corrected.
pub(crate) fn correction_maps(view: &View) -> Result<Vec<Figure>> {
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
    let constant = |(group, what): (&str, &str)| {
        let (_, map) = groups.iter().find(|(name, _)| *name == group)?;
        largest(map).map(|change| format!(" Besides, {what} moved every corrected pixel by {change:+.2} mm."))
    };
    let constants = [("offset", "the offset d0"), ("warm-up", "the drift of the warming camera")];
    let constants: String = constants.into_iter().filter_map(constant).collect();
    groups.retain(|(name, _)| !["offset", "warm-up"].contains(name));
    let mut all: Vec<f64> = groups.iter().flat_map(|(_, map)| map.iter().map(|change| change.abs())).collect();
    let limit = quantile(&mut all, 0.99);
    let limit = if limit.is_finite() { limit.max(0.1) } else { 0.1 };
    let scale = Scale { map: ColourMap::Diverging, low: -limit, high: limit, unit: "mm" };
    let of_first = if record.frequencies() > 1 { " Of the first frequency." } else { "" };
    let (width, _) = view.size();
    let figure = |(index, (name, map)): (usize, &(&str, Vec<f64>))| {
        let besides = if index == 0 { constants.as_str() } else { "" };
        let most = largest(map).unwrap_or(0.0);
        let caption = format!("New minus old range; the largest change is {most:+.2} mm.{of_first}{besides}");
        Ok(raster_figure(&format!("Correction: {name}"), width, map, &scale)?.caption(caption))
    };
    groups.iter().enumerate().map(figure).collect()
}

/// The value of largest magnitude.
fn largest(map: &[f64]) -> Option<f64> {
    map.iter().copied().filter(|value| value.is_finite()).max_by(|a, b| a.abs().total_cmp(&b.abs()))
}
