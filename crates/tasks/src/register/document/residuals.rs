//! What is left between the surfaces after a registration.

use nalgebra::Point3;
use pipeline::Result;
use report::{
    Axes, CATEGORIES, ColourMap, Figure, LineOfSight, Scale, Series, deviation_figure, histogram, raster_figure,
};
use statistics::{quantile, robust_standard_deviation};

use crate::register::Registered;

/// Stations whose pictures are shown; further ones would make the page heavy without telling more.
const PICTURED_STATIONS: usize = 8;
/// Points of a picture; more would not show.
const MOST_DRAWN: usize = 300_000;

/// Distances between surfaces in words and figures.
pub(crate) struct Residuals {
    pub(crate) words: String,
    pub(crate) distribution: Option<Figure>,
    /// Maps of frames, or clouds in the colours of their distances.
    pub(crate) pictures: Vec<Figure>,
}

/// What is left; `None` where no surfaces overlap, or all lie on each other.
pub(crate) fn residuals(registered: &Registered) -> Result<Option<Residuals>> {
    let all: Vec<f64> = registered.residuals_m.iter().flatten().copied().filter(|value| value.is_finite()).collect();
    let typical = robust_standard_deviation(&all);
    if all.is_empty() || typical.is_nan() || typical <= 0.0 {
        return Ok(None);
    }
    let scale = Scale { map: ColourMap::Diverging, low: -3e3 * typical, high: 3e3 * typical, unit: "mm" };
    let organised = registered.stations.iter().all(|station| station.file.size.is_some());
    let pictures = if organised { maps(registered, &scale)? } else { pictures(registered, &scale)? };
    let distribution = Some(distribution(registered, 4e3 * typical));
    Ok(Some(Residuals { words: words(all, typical), distribution, pictures }))
}

fn words(all: Vec<f64>, typical: f64) -> String {
    let count = all.len();
    let mut absolute: Vec<f64> = all.into_iter().map(f64::abs).collect();
    format!(
        "Signed distances of {count} points from the surfaces that other stations saw there, positive on the side that \
         the other station looks at: median {:.2} mm, 95 % below {:.2} mm (absolute), robust standard deviation {:.2} mm.",
        1e3 * quantile(&mut absolute, 0.5),
        1e3 * quantile(&mut absolute, 0.95),
        1e3 * typical
    )
}

fn distribution(registered: &Registered, reach_mm: f64) -> Figure {
    let sets: Vec<Series<'_, f64>> = registered
        .stations
        .iter()
        .zip(&registered.residuals_m)
        .zip(CATEGORIES)
        .take(PICTURED_STATIONS)
        .map(|((station, residuals), colour)| Series {
            name: &station.name,
            colour,
            values: residuals.iter().filter(|v| v.is_finite()).map(|v| 1e3 * v).collect(),
        })
        .collect();
    let axes = Axes { title: "Distances", x: "distance from the others' surfaces, mm", y: "% of points" };
    histogram(&axes, [-reach_mm, reach_mm], &sets)
}

/// One map a station, in the order of its pixels.
fn maps(registered: &Registered, scale: &Scale) -> Result<Vec<Figure>> {
    let mut figures = Vec::new();
    let stations = registered.stations.iter().zip(&registered.residuals_m);
    for (station, residuals) in stations.take(PICTURED_STATIONS) {
        let Some([width, _]) = station.file.size else { continue };
        let values: Vec<f64> = residuals.iter().map(|value| 1e3 * value).collect();
        let figure = raster_figure(&station.name, width, &values, scale)?;
        let caption = "Grey: seen by no other station, or no usable point.";
        figures.push(if figures.is_empty() { figure.caption(caption) } else { figure });
    }
    Ok(figures)
}

/// All points in the common frame in the colour of their distance.
fn pictures(registered: &Registered, scale: &Scale) -> Result<Vec<Figure>> {
    let (mut points, mut values) = (Vec::new(), Vec::new());
    for ((station, pose), residuals) in registered.stations.iter().zip(&registered.poses).zip(&registered.residuals_m) {
        for (point, value) in station.file.points.iter().zip(residuals).filter(|(_, value)| value.is_finite()) {
            points.push((pose.world_from_camera * Point3::from(*point)).coords.into());
            values.push(1e3 * value);
        }
    }
    let every = points.len().div_ceil(MOST_DRAWN).max(1);
    let points: Vec<[f64; 3]> = points.into_iter().step_by(every).collect();
    let values: Vec<_> = values.into_iter().step_by(every).collect();
    let mut figures = Vec::new();
    for view in LineOfSight::two(&points) {
        let title = format!("Distances, seen {}", view.name());
        let figure = deviation_figure(&title, &points, &values, view, scale)?;
        figures.push(figure.caption("Points that have a partner in another cloud."));
    }
    Ok(figures)
}
