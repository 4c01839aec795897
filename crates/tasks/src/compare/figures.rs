//! Figures of a comparison.

use pipeline::Result;
use report::{
    Axes, CATEGORIES, CHART_SIZE, Canvas, ColourMap, Figure, LineOfSight, Scale, Series, curves, deviation_figure,
    span, to_scale,
};
use statistics::quantile;

use crate::compare::{
    CloudComparison, Comparison, ComparisonPictures, Deviations, PlaneDistances, TrackCurves, TrackPoint,
};

/// Points of the curve of shares.
const CURVE_POINTS: usize = 200;
/// Points that are drawn; more than a picture has room for.
const MOST_DRAWN: usize = 2_000_000;

/// The figures of each section.
#[derive(Default)]
pub(crate) struct Figures {
    /// Clouds in the colours of their distances.
    pub(crate) clouds: Vec<Figure>,
    /// Distributions of the distances.
    pub(crate) distances: Vec<Figure>,
    /// Paths and their errors over time.
    pub(crate) trajectory: Vec<Figure>,
}

impl Figures {
    pub(crate) fn new(comparison: &Comparison, pictures: &ComparisonPictures) -> Result<Self> {
        let mut figures = Self::default();
        if let (Some(clouds), Some(deviations)) = (&comparison.clouds, &pictures.deviations) {
            figures.clouds = deviation_figures(clouds, deviations)?;
            let signed = clouds
                .plane
                .as_ref()
                .map(|plane| signed_histogram(plane).caption(format!("Positive: {}.", plane.positive)));
            let shares = shares(deviations).caption("How many points are nearer than a distance.");
            figures.distances = signed.into_iter().chain([shares]).collect();
        }
        figures.trajectory = pictures.tracks.as_ref().map(trajectory_figures).unwrap_or_default();
        Ok(figures)
    }
}

fn deviation_figures(clouds: &CloudComparison, deviations: &Deviations) -> Result<Vec<Figure>> {
    let every = deviations.points.len().div_ceil(MOST_DRAWN).max(1);
    let points: Vec<[f64; 3]> = deviations.points.iter().step_by(every).map(|point| point.coords.into()).collect();
    let signed = clouds.plane.as_ref().filter(|plane| plane.absolute_p95_m > 0.0);
    let (values, low, high, map, what) = if let Some(plane) = signed {
        let reach = 1e3 * plane.absolute_p95_m;
        (&deviations.signed_m, -reach, reach, ColourMap::Diverging, "Signed distance to the local plane")
    } else {
        let reach = (1e3 * clouds.distance_p95_m).max(1e-6);
        (&deviations.nearest_m, 0.0, reach, ColourMap::Sequential, "Distance to the nearest point")
    };
    let values: Vec<f64> = values.iter().step_by(every).map(|value| 1e3 * value).collect();
    let scale = Scale { map, low, high, unit: "mm" };
    LineOfSight::two(&points)
        .into_iter()
        .map(|view| {
            let title = format!("{what}, seen {}", view.name());
            let figure = deviation_figure(&title, &points, &values, view, &scale)?;
            let caption = "Colours end at 95 % of the distances. Grey: no surface of the reference below the point.";
            Ok(figure.caption(caption))
        })
        .collect()
}

fn signed_histogram(plane: &PlaneDistances) -> Figure {
    let histogram = &plane.histogram;
    let width = (histogram.high_m - histogram.low_m) / histogram.counts.len() as f64;
    let percent = |count: usize| 100.0 * count as f64 / plane.points as f64;
    let edge = |bin: usize| 1e3 * (histogram.low_m + width * bin as f64);
    let bars: Vec<_> =
        histogram.counts.iter().enumerate().map(|(bin, &count)| (edge(bin), edge(bin + 1), percent(count))).collect();
    let top = bars.iter().map(|bar| bar.2).fold(0.0, f64::max);
    let axes = Axes { title: "Signed distances to the local plane", x: "distance (mm)", y: "points (%)" };
    let mut canvas = Canvas::new(&axes, CHART_SIZE, [edge(0), edge(bars.len())], [0.0, 1.05 * top.max(1e-9)]);
    canvas.bars(&bars, CATEGORIES[0]);
    canvas.line(&[(1e3 * plane.mean_m, 0.0), (1e3 * plane.mean_m, 1.05 * top)], CATEGORIES[3], "4 3");
    canvas.name(CATEGORIES[3], "mean");
    canvas.finish()
}

/// Share of the points below each distance, up to that of 99 %.
fn shares(deviations: &Deviations) -> Figure {
    let curve = |values: &[f64]| -> Vec<(f64, f64)> {
        let mut sorted: Vec<f64> = values.iter().filter(|value| value.is_finite()).map(|value| value.abs()).collect();
        let end = 0.99;
        (0..=CURVE_POINTS)
            .map(|index| {
                let share = end * index as f64 / CURVE_POINTS as f64;
                (1e3 * quantile(&mut sorted, share), 100.0 * share)
            })
            .filter(|point| point.0.is_finite())
            .collect()
    };
    let mut sets = vec![Series { name: "nearest point", colour: CATEGORIES[0], values: curve(&deviations.nearest_m) }];
    let plane = curve(&deviations.signed_m);
    if !plane.is_empty() {
        sets.push(Series { name: "local plane", colour: CATEGORIES[1], values: plane });
    }
    curves(&Axes { title: "Share of nearer points", x: "distance (mm)", y: "points (%)" }, &sets)
}

fn trajectory_figures(tracks: &TrackCurves) -> Vec<Figure> {
    let aligned = match tracks.alignment {
        "as they stand" => "Both as they stand.",
        "rigid" => "Rigidly aligned.",
        _ => "Aligned with scale.",
    };
    vec![
        top_view(tracks).caption(format!("{aligned} The dot is the start.")),
        absolute_chart(tracks, "Position error over time", "position error (mm)", |p| 1e3 * p.position_error_m)
            .caption(aligned),
        absolute_chart(tracks, "Attitude error over time", "attitude error (°)", |p| p.attitude_error_deg)
            .caption(aligned),
        relative_chart(tracks, "Drift of the position", "translation error of a step (mm)", |s| 1e3 * s[1]),
        relative_chart(tracks, "Drift of the attitude", "rotation error of a step (°)", |s| s[2]),
    ]
}

/// The two axes along which the truth extends most, both to one scale.
fn top_view(tracks: &TrackCurves) -> Figure {
    const NAMES: [&str; 3] = ["x (m)", "y (m)", "z (m)"];
    let truth = || tracks.absolute.iter().map(|point| point.truth);
    let extent = |axis: usize| {
        let [low, high] = span(truth().map(|point| point[axis]));
        high - low
    };
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| extent(b).total_cmp(&extent(a)));
    let (right, up) = (order[0].min(order[1]), order[0].max(order[1]));
    let all = |axis: usize| tracks.absolute.iter().flat_map(move |point| [point.truth[axis], point.ours[axis]]);
    let (x, y) = to_scale(span(all(right)), span(all(up)));
    let axes = Axes { title: "Paths", x: NAMES[right], y: NAMES[up] };
    let mut canvas = Canvas::new(&axes, CHART_SIZE, x, y);
    let line = |of: fn(&TrackPoint) -> [f64; 3]| -> Vec<(f64, f64)> {
        tracks.absolute.iter().map(|point| (of(point)[right], of(point)[up])).collect()
    };
    let (truth, ours) = (line(|point| point.truth), line(|point| point.ours));
    canvas.line(&truth, CATEGORIES[7], "");
    canvas.line(&ours, CATEGORIES[0], "");
    canvas.points(&ours[..ours.len().min(1)], CATEGORIES[3], 1.0);
    canvas.name(CATEGORIES[7], "reference");
    canvas.name(CATEGORIES[0], "first");
    canvas.finish()
}

fn absolute_chart(tracks: &TrackCurves, title: &str, y: &str, value: fn(&TrackPoint) -> f64) -> Figure {
    let values = tracks.absolute.iter().map(|point| (point.time_s, value(point))).collect();
    let axes = Axes { title, x: "time since the first common pose (s)", y };
    curves(&axes, &[Series { name: "first", colour: CATEGORIES[0], values }])
}

fn relative_chart(tracks: &TrackCurves, title: &str, y: &str, value: fn(&[f64; 3]) -> f64) -> Figure {
    let sets: Vec<_> = tracks
        .relative
        .iter()
        .enumerate()
        .map(|(index, (name, steps))| Series {
            name,
            colour: CATEGORIES[index],
            values: steps.iter().map(|step| (step[0], value(step))).collect(),
        })
        .collect();
    curves(&Axes { title, x: "time of the step's begin (s)", y }, &sets)
}
