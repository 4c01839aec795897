//! Pictures: shares of variances, and sections through pairs of planes.

use measurement::{FittedPlane, PlaneDistance};
use nalgebra::Vector3;
use point_uncertainty::Source;
use report::{Axes, CATEGORIES, CHART_SIZE, Canvas, Figure, span};

use crate::measured::{AllFound, Found, Measured};
use crate::plan::LengthKind;
use crate::result::ResultCloud;
use crate::summary::MeasureSummary;

/// Most sections through planes on a page: each holds the points of two regions.
const MOST_SECTIONS: usize = 12;
/// Share of its place that a bar takes.
const BAR: f64 = 0.7;

/// Pictures of a measurement, as lengths come.
#[derive(Default)]
pub(crate) struct Pictures(Vec<Figure>);

impl Pictures {
    pub(crate) fn add(&mut self, measured: &Measured, quantity: &LengthKind, found: &AllFound, cloud: &ResultCloud) {
        let planes: Vec<&FittedPlane> = quantity
            .regions()
            .into_iter()
            .filter_map(|name| match found.get(name) {
                Some(Ok(Found::Plane(plane))) => Some(plane),
                _ => None,
            })
            .collect();
        if let (Some(distance), [one, two], true) = (&measured.planes, planes.as_slice(), self.0.len() < MOST_SECTIONS)
        {
            self.0.push(section(&measured.summary.name, distance, [one, two], cloud));
        }
    }

    /// All of them, the shares first.
    pub(crate) fn finish(mut self, summary: &MeasureSummary) -> Vec<Figure> {
        if summary.lengths.iter().any(|length| !length.shares.is_empty()) {
            self.0.insert(0, shares(summary));
        }
        self.0
    }
}

/// One bar a length, the shares of its variance on each other.
fn shares(summary: &MeasureSummary) -> Figure {
    let count = summary.lengths.len() as f64;
    let axes = Axes { title: "Shares of the variance", x: "length, in the order of the table", y: "share, %" };
    let mut canvas = Canvas::new(&axes, CHART_SIZE, [0.5, count + 0.5], [0.0, 100.0]);
    // The tallest first: each next one covers it from below.
    for last in (0..Source::ALL.len()).rev() {
        let bars: Vec<(f64, f64, f64)> = summary
            .lengths
            .iter()
            .enumerate()
            .filter(|(_, length)| !length.shares.is_empty())
            .map(|(at, length)| {
                let part = |source: &Source| length.shares.get(source.name()).copied().unwrap_or(0.0).max(0.0);
                let all: f64 = Source::ALL.iter().map(part).sum();
                let height = 100.0 * Source::ALL[..=last].iter().map(part).sum::<f64>() / all.max(f64::MIN_POSITIVE);
                let middle = at as f64 + 1.0;
                (middle - 0.5 * BAR, middle + 0.5 * BAR, height)
            })
            .collect();
        canvas.bars(&bars, CATEGORIES[last]);
    }
    for (source, colour) in Source::ALL.into_iter().zip(CATEGORIES) {
        canvas.name(colour, source.name());
    }
    canvas.finish().caption(
        "Shares of the variance by source; a share below zero (sources that compensate each other) is not shown.",
    )
}

/// Points of both regions, seen along the planes.
fn section(name: &str, distance: &PlaneDistance, planes: [&FittedPlane; 2], cloud: &ResultCloud) -> Figure {
    let flip = if planes[0].normal.dot(&planes[1].normal) < 0.0 { -1.0 } else { 1.0 };
    let mean = (planes[0].normal.into_inner() + planes[1].normal.into_inner() * flip).normalize();
    let along = direction(&mean, planes);
    let at = distance.at;
    let flat = |plane: &FittedPlane| -> Vec<(f64, f64)> {
        let ways = plane.support.kept.iter().map(|point| cloud.points[*point] - at);
        ways.map(|way| (along.dot(&way), mean.dot(&way))).collect()
    };
    let points = planes.map(flat);
    let all = || points.iter().flatten();
    let title = format!("Section: {name}");
    let axes = Axes { title: &title, x: "along the planes, m", y: "along the mean normal, m" };
    let across = span(all().map(|point| point.0));
    let mut canvas = Canvas::new(&axes, CHART_SIZE, across, span(all().map(|point| point.1)));
    let mut words = "";
    for (index, (points, colour)) in points.iter().zip(CATEGORIES).enumerate() {
        words = canvas.cloud(points, colour, 0.5).words().max(words);
        canvas.name(colour, if index == 0 { "first region" } else { "second region" });
    }
    let meet = |plane: &FittedPlane, x: f64| {
        let from = at + along * x;
        plane.normal.dot(&(plane.point - from)) / plane.normal.dot(&mean)
    };
    for plane in planes {
        canvas.line(&across.map(|x| (x, meet(plane, x))), [0, 0, 0], "");
    }
    canvas.line(&planes.map(|plane| (0.0, meet(plane, 0.0))), [0, 0, 0], "4 3");
    canvas.finish().caption(format!(
        "Points of both regions seen along their planes, the fitted planes, and where the distance is taken (dashed). Heights are \
         exaggerated.{words}"
    ))
}

/// From one region to the other along the planes; any direction where they stand one above the other.
fn direction(mean: &Vector3<f64>, planes: [&FittedPlane; 2]) -> Vector3<f64> {
    let across = |vector: Vector3<f64>| vector - mean * mean.dot(&vector);
    let way = across(planes[1].point - planes[0].point);
    let least = Vector3::ith(mean.iamin(), 1.0);
    let is_above = way.norm() < 0.1 * (planes[1].point - planes[0].point).norm();
    if is_above { across(least).normalize() } else { way.normalize() }
}
