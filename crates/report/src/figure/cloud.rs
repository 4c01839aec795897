//! The registered cloud from above and from the side.

use std::collections::BTreeMap;
use std::fmt::Write;

use statistics::quantile;

use super::Figure;
use super::canvas::ticks;
use super::colour::{CATEGORIES, hex};
use super::pictures::picture::data_uri;
use super::svg::{escape, open_svg};
use crate::Result;

/// Points of one station in the common frame.
#[derive(Debug, Clone)]
pub struct StationCloud<'a> {
    /// The station.
    pub name: &'a str,
    /// Points, metre.
    pub points: Vec<[f64; 3]>,
    /// Where the station stands, metre; NaN: not drawn.
    pub position: [f64; 3],
}

/// Which way one looks at the cloud.
#[derive(Debug, Clone, Copy)]
pub struct Direction {
    /// Index of the axis that goes right in the picture.
    pub right: usize,
    /// Index of the axis that goes up.
    pub up: usize,
    /// Index of the axis that one looks along; only the middle half along it is shown.
    pub along: usize,
}

impl Direction {
    /// From above and from the side, `vertical` being the index of the axis that points up.
    pub fn above_and_side(vertical: usize) -> [Self; 2] {
        match vertical {
            2 => [Self { right: 0, up: 1, along: 2 }, Self { right: 0, up: 2, along: 1 }],
            // In a camera's own frame y is up and the camera looks along -z.
            1 => [Self { right: 0, up: 2, along: 1 }, Self { right: 2, up: 1, along: 0 }],
            _ => [Self { right: 1, up: 2, along: 0 }, Self { right: 1, up: 0, along: 2 }],
        }
    }
}

const WIDTH: usize = 560;
/// Stations that are named below a picture; the colours come again after ten.
const MOST_NAMED: usize = 48;
const TALLEST: usize = 560;

/// A picture of a slice through all clouds, each station in its colour, with perspective centres and a metre grid.
///
/// # Errors
/// [`Error::Picture`](crate::Error::Picture) where it can't be packed.
pub fn cloud_figure(title: &str, clouds: &[StationCloud<'_>], direction: Direction) -> Result<Figure> {
    let view = Frame::around(clouds, direction);
    let mut rgb = vec![255_u8; 3 * view.width * view.height];
    for (station, cloud) in clouds.iter().enumerate() {
        let colour = CATEGORIES[station % CATEGORIES.len()];
        let shown = cloud.points.iter().filter(|point| view.shows(**point));
        for [x, y] in shown.filter_map(|point| view.pixel(*point)) {
            let at = 3 * (y * view.width + x);
            // Colours of several stations on one pixel darken each other instead of hiding.
            for k in 0..3 {
                rgb[at + k] = u16::midpoint(u16::from(rgb[at + k]), u16::from(colour[k])) as u8;
            }
        }
    }
    let image = data_uri(title, view.width, view.height, &rgb)?;
    let further = clouds.len().saturating_sub(MOST_NAMED);
    let named = &clouds[..clouds.len() - further];
    let more = format!("and {further} more");
    let names = || named.iter().map(|cloud| cloud.name).chain((further > 0).then_some(more.as_str()));
    let longest = names().map(|name| name.chars().count()).max().unwrap_or(0);
    // About 5.5 pixels a letter, behind the coloured square.
    let entry = (24.0 + 5.5 * longest as f64).max(70.0) as usize;
    let columns = (view.width / entry).max(1);
    let legend_rows = names().count().div_ceil(columns);
    let mut svg = open_svg(title, view.width as f64, view.height as f64 + 26.0 + 18.0 * legend_rows as f64);
    let _ = write!(svg, r#"<image href="{image}" x="0" y="22" width="{}" height="{}"/>"#, view.width, view.height);
    metre_grid(&mut svg, &view);
    let mut centres = BTreeMap::new();
    for (station, cloud) in clouds.iter().enumerate() {
        let colour = hex(CATEGORIES[station % CATEGORIES.len()]);
        if let Some([x, y]) = view.pixel(cloud.position) {
            centres.insert([x, y], colour);
        }
    }
    for ([x, y], colour) in centres {
        let _ = write!(svg, r##"<circle cx="{x}" cy="{}" r="4" fill="{colour}" stroke="#000"/>"##, y + 22);
    }
    for (station, name) in names().enumerate() {
        let colour =
            if station < named.len() { hex(CATEGORIES[station % CATEGORIES.len()]) } else { "none".to_owned() };
        let (x, y) = ((station % columns) * entry, view.height + 38 + 18 * (station / columns));
        let _ = write!(svg, r#"<rect x="{x}" y="{}" width="10" height="10" fill="{colour}"/>"#, y - 9);
        let _ = write!(svg, r#"<text x="{}" y="{y}" class="tick">{}</text>"#, x + 14, escape(name));
    }
    svg.push_str("</svg>");
    Ok(Figure::new(svg))
}

/// The part of space that a picture shows and its scale.
struct Frame {
    direction: Direction,
    low: [f64; 3],
    high: [f64; 3],
    metres_per_pixel: f64,
    width: usize,
    height: usize,
}

impl Frame {
    fn around(clouds: &[StationCloud<'_>], direction: Direction) -> Self {
        let (mut low, mut high) = ([0.0; 3], [1.0; 3]);
        for axis in 0..3 {
            let points = || clouds.iter().flat_map(move |cloud| cloud.points.iter().map(move |point| point[axis]));
            let values = || points().chain(clouds.iter().map(move |cloud| cloud.position[axis]));
            // A few stray points must not shrink the scene to a dot.
            let (l, h) = (
                quantile(&mut values().collect::<Vec<f64>>(), 0.001),
                quantile(&mut values().collect::<Vec<f64>>(), 0.999),
            );
            if h > l {
                (low[axis], high[axis]) = (l - 0.03 * (h - l), h + 0.03 * (h - l));
            }
        }
        let span = |axis: usize| high[axis] - low[axis];
        let metres_per_pixel = (span(direction.right) / WIDTH as f64).max(span(direction.up) / TALLEST as f64);
        let pixels = |axis: usize| ((span(axis) / metres_per_pixel) as usize).max(1);
        Self { direction, low, high, metres_per_pixel, width: pixels(direction.right), height: pixels(direction.up) }
    }

    /// Whether the point lies in the middle half along the direction of view.
    fn shows(&self, point: [f64; 3]) -> bool {
        let axis = self.direction.along;
        let quarter = (self.high[axis] - self.low[axis]) / 4.0;
        (self.low[axis] + quarter..=self.high[axis] - quarter).contains(&point[axis])
    }

    fn pixel(&self, point: [f64; 3]) -> Option<[usize; 2]> {
        let x = (point[self.direction.right] - self.low[self.direction.right]) / self.metres_per_pixel;
        let y = (self.high[self.direction.up] - point[self.direction.up]) / self.metres_per_pixel;
        let inside = x >= 0.0 && y >= 0.0 && x < self.width as f64 && y < self.height as f64;
        inside.then_some([x as usize, y as usize])
    }
}

fn metre_grid(svg: &mut String, view: &Frame) {
    let Direction { right, up, .. } = view.direction;
    let (bottom, end) = (view.height + 22, view.width);
    // Lines at whole metres in a room, closer in a small object, farther in a landscape.
    let (values, decimals) = ticks([view.low[right], view.high[right]], (view.width / 70).max(1));
    for metre in values {
        let x = (metre - view.low[right]) / view.metres_per_pixel;
        let _ = write!(svg, r##"<path d="M{x:.1} 22V{bottom}" stroke="#000" stroke-opacity=".12"/>"##);
        let _ = write!(svg, r#"<text x="{:.1}" y="{}" class="tick">{metre:.decimals$} m</text>"#, x + 2.0, bottom - 3);
    }
    let (values, decimals) = ticks([view.low[up], view.high[up]], (view.height / 70).max(1));
    for metre in values {
        let y = 22.0 + (view.high[up] - metre) / view.metres_per_pixel;
        let _ = write!(svg, r##"<path d="M0 {y:.1}H{end}" stroke="#000" stroke-opacity=".12"/>"##);
        let _ = write!(svg, r#"<text x="2" y="{:.1}" class="tick">{metre:.decimals$} m</text>"#, y - 2.0);
    }
}
