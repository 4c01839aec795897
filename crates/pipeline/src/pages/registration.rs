//! The page of a registration.

use super::registration_residuals::residual_section;
use crate::Result;
use crate::register::{Registered, Station};
use crate::summary::millimetres;
use nalgebra::{Isometry3, Point3};
use report::{Direction, Document, Edge, Node, StationCloud, cloud_figure, station_graph};

/// Points of one station in the pictures; more would not show.
const MOST_DRAWN: usize = 60_000;
/// Rows of the table of loops; the worst come first.
const MOST_LOOPS: usize = 20;

/// The whole page.
pub(crate) fn render_registration(registered: &Registered) -> Result<String> {
    let summary = &registered.summary;
    let points: usize = summary.stations.iter().map(|station| station.points).sum();
    let how = match summary.method {
        "multi" => "all stations adjusted at once",
        _ => "each onto the one before",
    };
    let lead = format!(
        "{} stations, {points} usable points, {how}. Start: {}. Datum: {}.",
        summary.stations.len(),
        summary.start,
        summary.datum
    );
    let mut page = Document::new("rangecam: registration", &lead);
    page.merits(cards(registered));
    page.warnings(&summary.doubts);
    cloud_section(&mut page, registered)?;
    residual_section(&mut page, registered)?;
    station_section(&mut page, registered);
    pair_section(&mut page, registered);
    Ok(page.html())
}

fn cards(registered: &Registered) -> Vec<(String, String)> {
    let summary = &registered.summary;
    let mut cards = vec![(summary.stations.len().to_string(), "stations".to_owned())];
    let mut card = |value: Option<f64>, name: &str| {
        if value.is_some() {
            cards.push((millimetres(value), name.to_owned()));
        }
    };
    card(summary.pairs.iter().map(|pair| pair.rms_m).max_by(f64::total_cmp), "largest rms of a pair");
    card(summary.position_sigma_max_m, "largest sigma of a position");
    card(summary.largest_misclosure().map(|worst| worst.0), "largest misclosure of a loop");
    card(summary.position_error_max_m, "largest error of a position (truth)");
    if let Some(degrees) = summary.attitude_error_max_deg {
        cards.push((format!("{degrees:.3}°"), "largest error of an attitude (truth)".to_owned()));
    }
    if let (Some(sigma0), Some(redundancy)) = (summary.sigma0, summary.redundancy) {
        cards.push((format!("{sigma0:.2}"), format!("sigma0, redundancy {redundancy}")));
    }
    cards.push((format!("{:.1} s", summary.seconds), "time".to_owned()));
    cards
}

/// The usable points of all stations at these poses.
fn moved<'a>(stations: &'a [Station], poses: &[Isometry3<f64>]) -> Vec<StationCloud<'a>> {
    let cloud = |(station, pose): (&'a Station, &Isometry3<f64>)| {
        let usable = station.usable_points();
        let finite: Vec<[f64; 3]> = usable.into_iter().filter(|point| point.iter().all(|x| x.is_finite())).collect();
        let every = finite.len().div_ceil(MOST_DRAWN).max(1);
        StationCloud {
            name: &station.name,
            points: finite.iter().step_by(every).map(|point| (pose * Point3::from(*point)).coords.into()).collect(),
            position: pose.translation.vector.into(),
        }
    };
    stations.iter().zip(poses).map(cloud).collect()
}

fn cloud_section(page: &mut Document, registered: &Registered) -> Result<()> {
    let after: Vec<Isometry3<f64>> = registered.poses.iter().map(|pose| pose.world_from_camera).collect();
    let (before, what) = match &registered.before {
        Some(before) => (before.clone(), "At the start poses"),
        None => (vec![Isometry3::identity(); after.len()], "As they came, each in its own frame"),
    };
    let directions = Direction::above_and_side(registered.vertical_axis);
    let note = "The middle half along the direction of view, one colour a station; dots are the origins of the \
                stations' frames.";
    for (title, poses, caption) in [("Before", &before, what), ("After", &after, note)] {
        page.section(&format!("{title} the registration"));
        let clouds = moved(&registered.stations, poses);
        let mut figures = Vec::new();
        for (name, direction) in ["from above", "from the side"].into_iter().zip(directions) {
            let figure = cloud_figure(&format!("{title}, {name}"), &clouds, direction)?;
            figures.push((figure, if figures.is_empty() { caption.to_owned() } else { String::new() }));
        }
        page.figures(figures);
    }
    Ok(())
}

fn station_section(page: &mut Document, registered: &Registered) {
    page.section("Stations");
    let summary = &registered.summary;
    let [above, _] = Direction::above_and_side(registered.vertical_axis);
    let place = |name: &str| summary.stations.iter().position(|station| station.name == name);
    let nodes: Vec<Node<'_>> = summary
        .stations
        .iter()
        .map(|station| Node {
            name: &station.name,
            at: [station.position_m[above.right], station.position_m[above.up]],
        })
        .collect();
    let edges: Vec<Edge> = summary
        .pairs
        .iter()
        .filter_map(|pair| {
            let (from, to) = (place(&pair.source)?, place(&pair.target)?);
            Some(Edge { from, to, overlap: pair.overlap, rms_m: pair.rms_m })
        })
        .collect();
    let caption = "Each line is a pair whose surfaces were held together: the wider, the more they overlap; the brighter, \
                   the farther their common surfaces lie apart (rms).";
    page.figures([(station_graph("Graph of the stations, from above", &nodes, &edges), caption.to_owned())]);
    let degrees = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |degrees| format!("{degrees:.4}°"));
    let truth = summary.position_error_max_m.is_some();
    let mut head = vec!["station", "points", "x m", "y m", "z m", "sigma of position", "sigma of attitude"];
    if truth {
        head.extend(["position error", "attitude error"]);
    }
    head.extend(["contradicting", "verdict"]);
    let rows = summary.stations.iter().enumerate().map(|(index, station)| {
        let mut row = vec![station.name.clone(), station.points.to_string()];
        row.extend(station.position_m.map(|x| format!("{x:.4}")));
        row.extend([millimetres(station.position_sigma_m), degrees(station.attitude_sigma_deg)]);
        if truth {
            row.extend([millimetres(station.position_error_m), degrees(station.attitude_error_deg)]);
        }
        row.push(station.placement.as_ref().map_or_else(|| "-".to_owned(), ToString::to_string));
        row.push(match (index, station.undetermined.is_empty()) {
            (0, _) => "datum".to_owned(),
            (_, true) => "determined".to_owned(),
            (_, false) => format!("open: {}", station.undetermined.join("; ")),
        });
        row
    });
    page.table(head, rows.collect());
}

fn pair_section(page: &mut Document, registered: &Registered) {
    let summary = &registered.summary;
    page.section("Pairs");
    let rows: Vec<Vec<String>> = summary
        .pairs
        .iter()
        .map(|pair| {
            vec![
                format!("{} onto {}", pair.source, pair.target),
                format!("{:.0} %", 100.0 * pair.overlap),
                millimetres(Some(pair.rms_m)),
                millimetres(pair.mean_m),
                if pair.undetermined.is_empty() { "determined".to_owned() } else { pair.undetermined.join("; ") },
            ]
        })
        .collect();
    page.table(["pair", "overlap", "rms", "mean distance", "the pair by itself"], rows);
    if !summary.loops.is_empty() {
        page.subsection("Loops");
        let mut loops: Vec<_> = summary.loops.iter().collect();
        loops.sort_by(|a, b| b.translation_m.total_cmp(&a.translation_m));
        if loops.len() > MOST_LOOPS {
            page.paragraph(&format!("The worst {MOST_LOOPS} of {}.", loops.len()));
        }
        let row = |closure: &&crate::RegisteredLoop| {
            vec![
                format!("{} – {}", closure.stations.join(" – "), closure.stations.first().map_or("", String::as_str)),
                millimetres(Some(closure.translation_m)),
                format!("{:.4}°", closure.rotation_deg),
            ]
        };
        let rows: Vec<Vec<String>> = loops.iter().take(MOST_LOOPS).map(row).collect();
        page.table(["loop", "misclosure", "in attitude"], rows);
    }
    if !summary.refused.is_empty() {
        page.subsection("Pairs left out");
        page.list(&summary.refused);
    }
}
