//! Figures of a registration.

use nalgebra::{Isometry3, Point3};
use pipeline::Result;
use pipeline::stations::Station;
use report::{Direction, Edge, Figure, Node, StationCloud, cloud_figure, station_graph};

use super::residuals::{Residuals, residuals};
use crate::register::Registered;

/// Points of one station in the pictures; more would not show.
const MOST_DRAWN: usize = 60_000;
/// Points of all stations together: of hundreds of stations each has a few pixels.
const MOST_IN_ALL: usize = 6_000_000;

/// What the page shows beside the summary.
#[derive(Default)]
pub(crate) struct Figures {
    /// The clouds before the registration.
    pub(crate) before: Vec<Figure>,
    /// And after it.
    pub(crate) after: Vec<Figure>,
    /// Distances between surfaces; `None` where there are none.
    pub(crate) residuals: Option<Residuals>,
    /// Which stations hold each other.
    pub(crate) graph: Option<Figure>,
}

impl Figures {
    pub(crate) fn new(registered: &Registered) -> Result<Self> {
        let after: Vec<Isometry3<f64>> = registered.poses.iter().map(|pose| pose.world_from_camera).collect();
        let (before, what) = match &registered.before {
            Some(before) => (before.clone(), "At the start poses"),
            None => (vec![Isometry3::identity(); after.len()], "As they came, each in its own frame"),
        };
        let note = "The middle half along the direction of view, one colour a station; dots are the origins of the \
                    stations' frames.";
        Ok(Self {
            before: clouds(registered, "Before", &before, what)?,
            after: clouds(registered, "After", &after, note)?,
            residuals: residuals(registered)?,
            graph: Some(graph(registered)),
        })
    }
}

/// All clouds from above and from the side.
fn clouds(registered: &Registered, title: &str, poses: &[Isometry3<f64>], caption: &str) -> Result<Vec<Figure>> {
    let clouds = moved(&registered.stations, poses);
    let [above, side] = Direction::above_and_side(registered.vertical_axis);
    Ok(vec![
        cloud_figure(&format!("{title}, from above"), &clouds, above)?.caption(caption),
        cloud_figure(&format!("{title}, from the side"), &clouds, side)?,
    ])
}

/// The usable points of all stations at these poses.
fn moved<'a>(stations: &'a [Station], poses: &[Isometry3<f64>]) -> Vec<StationCloud<'a>> {
    let most = MOST_DRAWN.min(MOST_IN_ALL / stations.len().max(1)).max(1);
    let cloud = |(station, pose): (&'a Station, &Isometry3<f64>)| {
        let usable = station.usable_points();
        let finite: Vec<[f64; 3]> = usable.into_iter().filter(|point| point.iter().all(|x| x.is_finite())).collect();
        let every = finite.len().div_ceil(most).max(1);
        StationCloud {
            name: &station.name,
            points: finite.iter().step_by(every).map(|point| (pose * Point3::from(*point)).coords.into()).collect(),
            position: pose.translation.vector.into(),
        }
    };
    stations.iter().zip(poses).map(cloud).collect()
}

/// Stations from above, and which are held together.
fn graph(registered: &Registered) -> Figure {
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
    station_graph("Graph of the stations, from above", &nodes, &edges).caption(caption)
}
