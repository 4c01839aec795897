//! A cloud seen along an axis, each point in the colour of its distance.

use statistics::quantile;
use std::fmt::Write;

use super::Figure;
use super::canvas::ticks;
use super::pictures::picture::{Scale, colour_bar, data_uri};
use super::svg::{escape, open_svg};
use crate::Result;

/// Which way one looks: axes that go right, up, and towards the viewer, with the sign of the last.
#[derive(Debug, Clone, Copy)]
pub struct LineOfSight {
    right: usize,
    up: usize,
    towards: usize,
    sign: f64,
}

impl LineOfSight {
    /// Along the axis of the least extent and along the one of the second least: what shows most of the points.
    pub fn two(points: &[[f64; 3]]) -> [Self; 2] {
        let extent = |axis: usize| {
            let values = || points.iter().map(move |point| point[axis]);
            quantile(&mut values().collect::<Vec<f64>>(), 0.99) - quantile(&mut values().collect::<Vec<f64>>(), 0.01)
        };
        let extents = [extent(0), extent(1), extent(2)];
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| extents[a].total_cmp(&extents[b]));
        [Self::along(order[0]), Self::along(order[1])]
    }

    /// Pictures with right-handed axes: x to the right where it is shown, z or y up.
    fn along(axis: usize) -> Self {
        match axis {
            0 => Self { right: 1, up: 2, towards: 0, sign: 1.0 },
            1 => Self { right: 0, up: 2, towards: 1, sign: -1.0 },
            _ => Self { right: 0, up: 1, towards: 2, sign: 1.0 },
        }
    }

    /// The view in words.
    pub fn name(&self) -> String {
        const AXES: [&str; 3] = ["x", "y", "z"];
        let sign = if self.sign > 0.0 { "−" } else { "+" };
        format!("along {sign}{}", AXES[self.towards])
    }
}

const LARGEST: f64 = 520.0;
const TOP: f64 = 24.0;
const LEFT: f64 = 52.0;
const BOTTOM: f64 = 34.0;
/// Behind the points: dark, so that the middle of a map from blue over white to red stands out.
const BACKGROUND: [u8; 3] = [43, 49, 58];

/// Points (metre) in the colours of their values; those nearer to the viewer hide those behind them.
///
/// # Errors
/// [`Error::Picture`](crate::Error::Picture) where it can't be packed.
pub fn deviation_figure(
    title: &str,
    points: &[[f64; 3]],
    values: &[f64],
    view: LineOfSight,
    scale: &Scale,
) -> Result<Figure> {
    let frame = Frame::around(points, view);
    let image = data_uri(title, frame.width, frame.height, &frame.pixels(points, values, view, scale))?;
    let (width, height) = (frame.width as f64, frame.height as f64);
    let mut svg = open_svg(title, LEFT + width + 86.0, TOP + height + BOTTOM);
    // Writing to a string can't fail.
    let _ = write!(svg, r#"<image href="{image}" x="{LEFT}" y="{TOP}" width="{width}" height="{height}"/>"#);
    frame.axes(&mut svg, view);
    colour_bar(&mut svg, scale, LEFT + width + 10.0, TOP, height);
    svg.push_str("</svg>");
    Ok(Figure::new(svg))
}

/// The part of space that is shown.
struct Frame {
    right: [f64; 2],
    up: [f64; 2],
    metres_per_pixel: f64,
    width: usize,
    height: usize,
}

impl Frame {
    fn around(points: &[[f64; 3]], view: LineOfSight) -> Self {
        let span = |axis: usize| {
            let values = || points.iter().map(move |point| point[axis]);
            // A few stray points must not shrink the rest to a dot.
            let (low, high) = (
                quantile(&mut values().collect::<Vec<f64>>(), 0.001),
                quantile(&mut values().collect::<Vec<f64>>(), 0.999),
            );
            let margin = (0.04 * (high - low)).max(1e-9 * (1.0 + low.abs()));
            [low - margin, high + margin]
        };
        let (right, up) = (span(view.right), span(view.up));
        let extent = |[low, high]: [f64; 2]| high - low;
        let metres_per_pixel = extent(right).max(extent(up)) / LARGEST;
        let pixels = |span: [f64; 2]| ((extent(span) / metres_per_pixel) as usize).max(48);
        Self { right, up, metres_per_pixel, width: pixels(right), height: pixels(up) }
    }

    fn pixels(&self, points: &[[f64; 3]], values: &[f64], view: LineOfSight, scale: &Scale) -> Vec<u8> {
        let mut rgb: Vec<u8> = BACKGROUND.repeat(self.width * self.height);
        let mut nearest = vec![f64::NEG_INFINITY; self.width * self.height];
        // Dots as large as the gaps between few points, so that a surface looks like one.
        let gap = (0.7 * (self.width * self.height) as f64 / points.len().max(1) as f64).sqrt();
        let reach = (gap.round() as isize / 2).clamp(0, 3);
        for (point, value) in points.iter().zip(values) {
            let x = ((point[view.right] - self.right[0]) / self.metres_per_pixel).floor() as isize;
            let y = ((self.up[1] - point[view.up]) / self.metres_per_pixel).floor() as isize;
            let depth = view.sign * point[view.towards];
            let colour = scale.colour(*value);
            for (dx, dy) in (-reach..=reach).flat_map(|dx| (-reach..=reach).map(move |dy| (dx, dy))) {
                let (x, y) = (x.saturating_add(dx), y.saturating_add(dy));
                if x < 0 || y < 0 || x >= self.width as isize || y >= self.height as isize {
                    continue;
                }
                let at = y as usize * self.width + x as usize;
                if depth > nearest[at] {
                    nearest[at] = depth;
                    rgb[3 * at..3 * at + 3].copy_from_slice(&colour);
                }
            }
        }
        rgb
    }

    /// Ticks in metres along the left and the lower side, with faint lines through the picture.
    fn axes(&self, svg: &mut String, view: LineOfSight) {
        const AXES: [&str; 3] = ["x", "y", "z"];
        let (width, height) = (self.width as f64, self.height as f64);
        let (values, decimals) = ticks(self.right, (self.width / 80).max(1));
        for value in values {
            let x = LEFT + (value - self.right[0]) / self.metres_per_pixel;
            let bottom = TOP + height;
            let _ = write!(
                svg,
                r##"<path d="M{x:.1} {TOP}V{bottom}" stroke="#fff" stroke-opacity=".14"/><text x="{x:.1}" y="{}" class="tick" text-anchor="middle">{value:.decimals$}</text>"##,
                bottom + 13.0
            );
        }
        let (values, decimals) = ticks(self.up, (self.height / 60).max(1));
        for value in values {
            let y = TOP + (self.up[1] - value) / self.metres_per_pixel;
            let _ = write!(
                svg,
                r##"<path d="M{LEFT} {y:.1}h{width}" stroke="#fff" stroke-opacity=".14"/><text x="{}" y="{:.1}" class="tick" text-anchor="end">{value:.decimals$}</text>"##,
                LEFT - 4.0,
                y + 3.5
            );
        }
        let _ = write!(
            svg,
            r#"<text x="{}" y="{}" class="tick" text-anchor="middle">{} (m)</text><text transform="translate(10 {}) rotate(-90)" class="tick" text-anchor="middle">{} (m)</text>"#,
            LEFT + width / 2.0,
            TOP + height + 28.0,
            escape(AXES[view.right]),
            TOP + height / 2.0,
            escape(AXES[view.up])
        );
    }
}
