//! Stations as a graph: where they stand, and which are held together.

use std::fmt::Write;

use super::Figure;
use super::canvas::{span, ticks};
use super::colour::{ColourMap, hex};
use super::pictures::picture::{Scale, colour_bar};
use super::svg::{escape, open_svg};

/// A station in the plane of the picture.
#[derive(Debug, Clone, Copy)]
pub struct Node<'a> {
    /// Its name.
    pub name: &'a str,
    /// Coordinates to the right and up, metre.
    pub at: [f64; 2],
}

/// A pair of stations, by their indices.
#[derive(Debug, Clone, Copy)]
pub struct Edge {
    /// Index of one station.
    pub from: usize,
    /// Index of the other.
    pub to: usize,
    /// 0 to 1.
    pub overlap: f64,
    /// How far their common surfaces lie apart, metre.
    pub rms_m: f64,
}

const WIDTH: f64 = 560.0;
const TALLEST: f64 = 480.0;
const SMALLEST: f64 = 150.0;
const LEFT: f64 = 52.0;
const TOP: f64 = 26.0;
const BOTTOM: f64 = 34.0;

/// Place of the plotted area, one scale for both axes.
struct Plane {
    low: [f64; 2],
    high: [f64; 2],
    pixels_per_metre: f64,
    size: [f64; 2],
}

impl Plane {
    fn around(nodes: &[Node<'_>]) -> Self {
        let spans = [0, 1].map(|axis| {
            let values = || nodes.iter().map(move |node| node.at[axis]);
            let [low, high] = span(values());
            let margin = 0.08 * (high - low);
            [low - margin, high + margin]
        });
        let extents = spans.map(|[low, high]| high - low);
        let pixels_per_metre = (WIDTH / extents[0]).min(TALLEST / extents[1]);
        // A row of stations must not become a picture without height.
        let size = extents.map(|extent| (extent * pixels_per_metre).max(SMALLEST));
        let middle = spans.map(|[low, high]| f64::midpoint(low, high));
        let half = size.map(|pixels| 0.5 * pixels / pixels_per_metre);
        Self {
            low: [middle[0] - half[0], middle[1] - half[1]],
            high: [middle[0] + half[0], middle[1] + half[1]],
            pixels_per_metre,
            size,
        }
    }

    fn pixel(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [LEFT + (x - self.low[0]) * self.pixels_per_metre, TOP + (self.high[1] - y) * self.pixels_per_metre]
    }

    fn grid(&self, svg: &mut String) {
        let [width, height] = self.size;
        let (right, bottom) = (LEFT + width, TOP + height);
        // Writing to a string can't fail.
        let _ = write!(
            svg,
            r##"<rect x="{LEFT}" y="{TOP}" width="{width:.1}" height="{height:.1}" fill="#fbfcfd" stroke="#c5ccd6"/>"##
        );
        let (values, decimals) = ticks([self.low[0], self.high[0]], (width / 80.0) as usize);
        for value in values {
            let [x, _] = self.pixel([value, 0.0]);
            let _ = write!(
                svg,
                r##"<path d="M{x:.1} {TOP}V{bottom:.1}" stroke="#e4e8ed"/><text x="{x:.1}" y="{:.1}" class="tick" text-anchor="middle">{value:.decimals$}</text>"##,
                bottom + 13.0
            );
        }
        let (values, decimals) = ticks([self.low[1], self.high[1]], (height / 60.0) as usize);
        for value in values {
            let [_, y] = self.pixel([0.0, value]);
            let _ = write!(
                svg,
                r##"<path d="M{LEFT} {y:.1}H{right:.1}" stroke="#e4e8ed"/><text x="{}" y="{:.1}" class="tick" text-anchor="end">{value:.decimals$}</text>"##,
                LEFT - 5.0,
                y + 3.5
            );
        }
        let _ = write!(
            svg,
            r#"<text x="{:.1}" y="{:.1}" class="tick" text-anchor="middle">metre</text>"#,
            LEFT + width / 2.0,
            bottom + 28.0
        );
    }
}

/// Stations and the pairs between them: the wider a line, the more they overlap; the brighter, the farther apart their common
/// surfaces lie.
pub fn station_graph(title: &str, nodes: &[Node<'_>], edges: &[Edge]) -> Figure {
    let plane = Plane::around(nodes);
    let [width, height] = plane.size;
    let mut svg = open_svg(title, LEFT + width + 86.0, TOP + height + BOTTOM);
    plane.grid(&mut svg);
    let largest = edges.iter().map(|edge| 1e3 * edge.rms_m).fold(0.0, f64::max);
    let scale = Scale { map: ColourMap::Sequential, low: 0.0, high: largest.max(1e-9), unit: "mm" };
    for edge in edges {
        let [x1, y1] = plane.pixel(nodes[edge.from].at);
        let [x2, y2] = plane.pixel(nodes[edge.to].at);
        let (wide, colour) = (1.0 + 7.0 * edge.overlap.clamp(0.0, 1.0), hex(scale.colour(1e3 * edge.rms_m)));
        let _ = write!(
            svg,
            r#"<path d="M{x1:.1} {y1:.1}L{x2:.1} {y2:.1}" stroke="{colour}" stroke-width="{wide:.1}" stroke-opacity=".85" stroke-linecap="round"/>"#
        );
    }
    for node in nodes {
        let [x, y] = plane.pixel(node.at);
        let _ = write!(
            svg,
            r##"<circle cx="{x:.1}" cy="{y:.1}" r="5" fill="#fff" stroke="#1c2430" stroke-width="2"/><text x="{:.1}" y="{:.1}" class="tick" style="font-weight:600;paint-order:stroke;stroke:#fff;stroke-width:3px">{}</text>"##,
            x + 8.0,
            y - 7.0,
            escape(node.name)
        );
    }
    colour_bar(&mut svg, &scale, LEFT + width + 10.0, TOP, height);
    svg.push_str("</svg>");
    Figure::new(svg)
}
