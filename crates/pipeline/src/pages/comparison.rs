//! The report of a comparison.

use crate::Result;
use crate::compare::{
    CloudComparison, Comparison, ComparisonPictures, Deviations, PlaneDistances, PoseComparison, TrackCurves,
    TrajectoryComparison, TrajectoryStatistics, millimetres_of as mm,
};
use crate::statistics::quantile;
use crate::verdict::Judged;
use report::{
    Axes, CATEGORIES, CHART_SIZE, Canvas, ColourMap, Document, Figure, LineOfSight, Scale, Series, curves,
    deviation_figure, span, to_scale,
};

/// Points of the curve of shares.
const CURVE_POINTS: usize = 200;
/// Points that are drawn; more than a picture has room for.
const MOST_DRAWN: usize = 2_000_000;

/// The whole page.
pub(crate) fn render_comparison(comparison: &Comparison, pictures: &ComparisonPictures) -> Result<String> {
    let lead = format!("{} against {}, which is taken as the reference.", comparison.first, comparison.second);
    let mut page = Document::new("rangecam: comparison", &lead);
    page.warnings(comparison.doubts());
    if let (Some(clouds), Some(deviations)) = (&comparison.clouds, &pictures.deviations) {
        cloud_section(&mut page, clouds, deviations)?;
    }
    if let Some(poses) = &comparison.poses {
        station_section(&mut page, poses);
    }
    if let (Some(trajectory), Some(tracks)) = (&comparison.trajectory, &pictures.tracks) {
        trajectory_section(&mut page, trajectory, tracks);
    }
    Ok(page.html())
}

fn cloud_section(page: &mut Document, clouds: &CloudComparison, deviations: &Deviations) -> Result<()> {
    page.section("Clouds");
    let mut cards = vec![
        (mm(clouds.distance_median_m), "median distance to the nearest point".to_owned()),
        (mm(clouds.distance_p95_m), "95 % are nearer".to_owned()),
    ];
    if let Some(plane) = &clouds.plane {
        cards.push((mm(plane.absolute_median_m), "median distance to the local plane".to_owned()));
        cards.push((mm(plane.rms_m), "rms distance to the local plane".to_owned()));
        cards.push((mm(plane.mean_m), "mean signed distance".to_owned()));
    }
    page.merits(cards);
    page.paragraph(&format!(
        "{} points against {}; {} more are flagged or without position, {} too far away.",
        clouds.points, clouds.reference_points, clouds.left_out, clouds.beyond
    ));
    if let Some(alignment) = &clouds.alignment {
        let ([x, y, z], [a, b, c]) = (alignment.translation_m, alignment.rotation_deg);
        page.paragraph(&format!(
            "Registered before: moved by ({x:.4}, {y:.4}, {z:.4}) m, turned by ({a:.3}, {b:.3}, {c:.3}) degrees; {:.0} % of \
             the points have a partner, rms {}.",
            100.0 * alignment.overlap,
            mm(alignment.rms_m)
        ));
    }
    distance_table(page, clouds);
    page.figures(deviation_figures(clouds, deviations)?);
    let mut charts = Vec::new();
    if let Some(plane) = &clouds.plane {
        let caption = format!("Positive: {}.", plane.positive);
        charts.push((signed_histogram(plane), caption));
    }
    charts.push((shares(deviations), "How many points are nearer than a distance.".to_owned()));
    page.figures(charts);
    Ok(())
}

fn distance_table(page: &mut Document, clouds: &CloudComparison) {
    let mut rows = vec![vec![
        "nearest point".to_owned(),
        mm(clouds.distance_median_m),
        mm(clouds.distance_p95_m),
        mm(clouds.distance_rms_m),
        mm(clouds.distance_max_m),
        clouds.points.to_string(),
    ]];
    if let Some(plane) = &clouds.plane {
        rows.push(vec![
            "local plane".to_owned(),
            mm(plane.absolute_median_m),
            mm(plane.absolute_p95_m),
            mm(plane.rms_m),
            mm(plane.absolute_max_m),
            plane.points.to_string(),
        ]);
    }
    page.table(["distance to", "median", "95 %", "rms", "largest", "points"], rows);
}

fn deviation_figures(clouds: &CloudComparison, deviations: &Deviations) -> Result<Vec<(Figure, String)>> {
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
            Ok((figure, caption.to_owned()))
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

fn station_section(page: &mut Document, poses: &PoseComparison) {
    page.section("Stations");
    page.merits([
        (mm(poses.position_rms_m), "rms difference of the positions".to_owned()),
        (mm(poses.position_max_m), "largest".to_owned()),
        (format!("{:.4}°", poses.attitude_max_deg), "largest difference of the attitudes".to_owned()),
    ]);
    page.paragraph(&format!(
        "{} stations in common, {} only in the first, {} only in the second. Differences are first less second.",
        poses.poses, poses.only_first, poses.only_second
    ));
    let rows: Vec<Vec<String>> = poses
        .stations
        .iter()
        .map(|row| {
            let length = nalgebra::Vector3::from(row.position_m).norm();
            let [x, y, z] = row.position_m.map(mm);
            vec![row.station.clone(), x, y, z, mm(length), format!("{:.4}°", row.attitude_deg)]
        })
        .collect();
    page.table(["station", "x", "y", "z", "length", "attitude"], rows);
}

fn trajectory_section(page: &mut Document, trajectory: &TrajectoryComparison, tracks: &TrackCurves) {
    page.section("Trajectory");
    let [a, b] = trajectory.poses;
    page.paragraph(&format!("{} poses in common, of {a} and {b}.", trajectory.matched));
    let row = |name: String, metres: &TrajectoryStatistics, degrees: &TrajectoryStatistics| {
        let mut cells = vec![name];
        cells.extend([metres.rms, metres.median, metres.max].map(mm));
        cells.extend([degrees.rms, degrees.median, degrees.max].map(|value| format!("{value:.3}°")));
        cells
    };
    let mut rows: Vec<Vec<String>> = trajectory
        .absolute
        .iter()
        .map(|line| {
            let name = match line.alignment {
                "with scale" => format!("absolute, scale {:.5}", line.scale),
                "rigid" => "absolute, rigidly aligned".to_owned(),
                other => format!("absolute, {other}"),
            };
            row(name, &line.position_m, &line.attitude_deg)
        })
        .collect();
    let relative = trajectory.relative.iter();
    rows.extend(
        relative.map(|line| row(format!("relative over {}", line.step), &line.translation_m, &line.rotation_deg)),
    );
    let head = ["error", "position rms", "median", "largest", "attitude rms", "median", "largest"];
    page.table(head, rows);
    let worst: Vec<String> =
        trajectory.worst.iter().map(|[time, error]| format!("{} at {time:.3} s", mm(*error))).collect();
    page.paragraph(&format!("Largest errors: {}.", worst.join(", ")));
    let aligned = match tracks.alignment {
        "as they stand" => "Both as they stand.",
        "rigid" => "Rigidly aligned.",
        _ => "Aligned with scale.",
    };
    page.figures([
        (top_view(tracks), format!("{aligned} The dot is the start.")),
        (
            absolute_chart(tracks, "Position error over time", "position error (mm)", |p| 1e3 * p.position_error_m),
            aligned.to_owned(),
        ),
        (
            absolute_chart(tracks, "Attitude error over time", "attitude error (°)", |p| p.attitude_error_deg),
            aligned.to_owned(),
        ),
        (
            relative_chart(tracks, "Drift of the position", "translation error of a step (mm)", |s| 1e3 * s[1]),
            String::new(),
        ),
        (relative_chart(tracks, "Drift of the attitude", "rotation error of a step (°)", |s| s[2]), String::new()),
    ]);
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
    let line = |of: fn(&crate::compare::TrackPoint) -> [f64; 3]| -> Vec<(f64, f64)> {
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

fn absolute_chart(tracks: &TrackCurves, title: &str, y: &str, value: fn(&crate::compare::TrackPoint) -> f64) -> Figure {
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
