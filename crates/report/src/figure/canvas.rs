//! A chart's axes and marks, drawn straight into an SVG.

use statistics::quantile;
use std::fmt::Write;

use super::Figure;
use super::colour::hex;
use super::density::{thin_dots, thin_line};
use super::svg::{escape, open_svg};

/// What stands around a chart.
#[derive(Debug, Clone, Copy)]
pub struct Axes<'a> {
    /// Title.
    pub title: &'a str,
    /// Name and unit of what goes to the right.
    pub x: &'a str,
    /// Name and unit of what goes up.
    pub y: &'a str,
}

/// Place of the plotted area in a figure: room for ticks at the left and below, for the title above.
const MARGIN: Margin = Margin { left: 56.0, top: 26.0, right: 12.0, bottom: 40.0 };

struct Margin {
    left: f64,
    top: f64,
    right: f64,
    bottom: f64,
}

/// Side of a square in which values are counted, pixels of the figure: large enough to be seen.
const DENSITY_CELL: f64 = 4.0;
/// Shades of a density.
const DENSITY_CLASSES: usize = 6;
/// Area of a dot, square pixels.
const DOT_AREA: f64 = 9.0;
/// Part of the plotted area that dots may have together: with more, they lie on each other, and all is one dark spot.
const MOST_INK: f64 = 0.35;

/// How a cloud of values was drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Drawn {
    /// Each as a dot.
    Dots,
    /// All by their density.
    Density,
}

impl Drawn {
    /// What a caption has to say of it.
    pub fn words(self) -> &'static str {
        match self {
            Self::Dots => "",
            Self::Density => " The darker, the more values (logarithmic).",
        }
    }
}

/// A chart that grows mark by mark.
#[derive(Debug, Clone)]
pub struct Canvas {
    svg: String,
    /// Number that makes the clip path's name unique in a page with many figures.
    clip: String,
    size: [f64; 2],
    x: [f64; 2],
    y: [f64; 2],
    legend: Vec<(String, String)>,
}

impl Canvas {
    /// Axes with a grid over the spans `x` and `y`; `size` is that of the whole figure in pixels.
    pub fn new(axes: &Axes<'_>, size: [f64; 2], x: [f64; 2], y: [f64; 2]) -> Self {
        let mut svg = open_svg(axes.title, size[0], size[1]);
        let clip = format!("c{:x}", fingerprint(axes.title, &[x, y]));
        let (width, height) = (size[0] - MARGIN.left - MARGIN.right, size[1] - MARGIN.top - MARGIN.bottom);
        // Writing to a string can't fail.
        let _ = write!(
            svg,
            r##"<clipPath id="{clip}"><rect x="{}" y="{}" width="{width}" height="{height}"/></clipPath><rect x="{}" y="{}" width="{width}" height="{height}" fill="#fbfcfd" stroke="#c5ccd6"/>"##,
            MARGIN.left, MARGIN.top, MARGIN.left, MARGIN.top
        );
        let mut canvas = Self { svg, clip, size, x, y, legend: Vec::new() };
        canvas.ticks();
        let (middle, bottom) = (MARGIN.left + width / 2.0, size[1] - 6.0);
        let _ = write!(
            canvas.svg,
            r#"<text x="{middle}" y="{bottom}" class="tick" text-anchor="middle">{}</text>"#,
            escape(axes.x)
        );
        let at = MARGIN.top + height / 2.0;
        let _ = write!(
            canvas.svg,
            r#"<text transform="translate(12 {at}) rotate(-90)" class="tick" text-anchor="middle">{}</text>"#,
            escape(axes.y)
        );
        canvas
    }

    /// Width and height of the plotted area in a figure of this size, pixel.
    pub fn plotted(size: [f64; 2]) -> [f64; 2] {
        [size[0] - MARGIN.left - MARGIN.right, size[1] - MARGIN.top - MARGIN.bottom]
    }

    fn ticks(&mut self) {
        let (right, bottom) = (self.size[0] - MARGIN.right, self.size[1] - MARGIN.bottom);
        let (values, decimals) = ticks(self.x, 6);
        for value in values {
            let [x, _] = self.at([value, self.y[0]]);
            let _ = write!(
                self.svg,
                r##"<path d="M{x:.1} {}V{bottom}" stroke="#e4e8ed"/><text x="{x:.1}" y="{}" class="tick" text-anchor="middle">{value:.decimals$}</text>"##,
                MARGIN.top,
                bottom + 14.0
            );
        }
        let (values, decimals) = ticks(self.y, 6);
        for value in values {
            let [_, y] = self.at([self.x[0], value]);
            let stroke = if value == 0.0 { "#9aa5b1" } else { "#e4e8ed" };
            let _ = write!(
                self.svg,
                r#"<path d="M{} {y:.1}H{right}" stroke="{stroke}"/><text x="{}" y="{:.1}" class="tick" text-anchor="end">{value:.decimals$}</text>"#,
                MARGIN.left,
                MARGIN.left - 5.0,
                y + 3.5
            );
        }
    }

    /// Place of a value in the figure.
    fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let share = |value: f64, [low, high]: [f64; 2]| (value - low) / (high - low);
        let (width, height) = (self.size[0] - MARGIN.left - MARGIN.right, self.size[1] - MARGIN.top - MARGIN.bottom);
        [MARGIN.left + width * share(x, self.x), MARGIN.top + height * (1.0 - share(y, self.y))]
    }

    /// Dots, all in one path: thousands of them stay light. Of very many, those that would lie on each other are drawn once.
    pub fn points(&mut self, values: &[(f64, f64)], colour: [u8; 3], opacity: f64) {
        let places: Vec<[f64; 2]> = finite(values).map(|(x, y)| self.at([x, y])).collect();
        let mut path = String::new();
        for [x, y] in thin_dots(places) {
            let _ = write!(path, "M{x:.1} {y:.1}h0");
        }
        let _ = write!(
            self.svg,
            r#"<path d="{path}" clip-path="url(#{})" fill="none" stroke="{}" stroke-opacity="{opacity}" stroke-width="3.4" stroke-linecap="round"/>"#,
            self.clip,
            hex(colour)
        );
    }

    /// Many values, by the density of what would be dots: squares of `DENSITY_CELL` pixels, the darker the more values, on a
    /// logarithmic scale.
    pub fn density(&mut self, values: &[(f64, f64)], colour: [u8; 3]) {
        let [width, height] = Self::plotted(self.size);
        let (columns, rows) = ((width / DENSITY_CELL).ceil() as usize, (height / DENSITY_CELL).ceil() as usize);
        let mut counts = vec![0_usize; columns * rows];
        for (x, y) in finite(values) {
            let [x, y] = self.at([x, y]);
            let place = [(x - MARGIN.left) / DENSITY_CELL, (y - MARGIN.top) / DENSITY_CELL];
            if place[0] >= 0.0 && place[1] >= 0.0 && (place[0] as usize) < columns && (place[1] as usize) < rows {
                counts[place[1] as usize * columns + place[0] as usize] += 1;
            }
        }
        let most = counts.iter().copied().max().unwrap_or(0) as f64;
        let mut paths = vec![String::new(); DENSITY_CLASSES];
        for (index, count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
            let share = (*count as f64).ln_1p() / most.ln_1p();
            let class = ((share * DENSITY_CLASSES as f64) as usize).min(DENSITY_CLASSES - 1);
            let x = MARGIN.left + DENSITY_CELL * (index % columns) as f64;
            let y = MARGIN.top + DENSITY_CELL * (index / columns) as f64;
            // Writing to a string can't fail.
            let _ = write!(paths[class], "M{x} {y}h{DENSITY_CELL}v{DENSITY_CELL}h-{DENSITY_CELL}z");
        }
        for (class, path) in paths.iter().enumerate().filter(|(_, path)| !path.is_empty()) {
            let opacity = 0.75 * (class + 1) as f64 / DENSITY_CLASSES as f64;
            let _ = write!(
                self.svg,
                r#"<path d="{path}" clip-path="url(#{})" fill="{}" fill-opacity="{opacity:.2}"/>"#,
                self.clip,
                hex(colour)
            );
        }
    }

    /// Whether so many dots in a figure of this size would lie on each other.
    pub fn is_dense(size: [f64; 2], dots: usize) -> bool {
        let [width, height] = Self::plotted(size);
        dots as f64 * DOT_AREA > MOST_INK * width * height
    }

    /// Dots, or their density where they would lie on each other; which of them was drawn.
    pub fn cloud(&mut self, values: &[(f64, f64)], colour: [u8; 3], opacity: f64) -> Drawn {
        if Self::is_dense(self.size, values.len()) {
            self.density(values, colour);
            return Drawn::Density;
        }
        self.points(values, colour, opacity);
        Drawn::Dots
    }

    /// A line through points; a gap where a value is missing. Of very many, those that no eye tells apart are left out.
    pub fn line(&mut self, values: &[(f64, f64)], colour: [u8; 3], dashes: &str) {
        let mut path = String::new();
        let places: Vec<[f64; 2]> = values.iter().map(|&(x, y)| self.at([x, y])).collect();
        let mut pen = 'M';
        for [x, y] in thin_line(places) {
            if !(x.is_finite() && y.is_finite()) {
                pen = 'M';
                continue;
            }
            let _ = write!(path, "{pen}{x:.1} {y:.1}");
            pen = 'L';
        }
        let _ = write!(
            self.svg,
            r#"<path d="{path}" clip-path="url(#{})" fill="none" stroke="{}" stroke-width="2" stroke-dasharray="{dashes}"/>"#,
            self.clip,
            hex(colour)
        );
    }

    /// The area between two curves with common abscissae: `(x, low, high)`.
    pub fn band(&mut self, values: &[(f64, f64, f64)], colour: [u8; 3], opacity: f64) {
        let known = || values.iter().filter(|(x, low, high)| x.is_finite() && low.is_finite() && high.is_finite());
        let upper = known().map(|(x, _, high)| (*x, *high));
        let lower = known().rev().map(|(x, low, _)| (*x, *low));
        let mut path = String::new();
        for (index, (x, y)) in upper.chain(lower).enumerate() {
            let [x, y] = self.at([x, y]);
            let _ = write!(path, "{}{x:.1} {y:.1}", if index == 0 { 'M' } else { 'L' });
        }
        let _ = write!(
            self.svg,
            r#"<path d="{path}Z" clip-path="url(#{})" fill="{}" fill-opacity="{opacity}"/>"#,
            self.clip,
            hex(colour)
        );
    }

    /// Bars from zero: lower and upper end along x, and height.
    pub fn bars(&mut self, values: &[(f64, f64, f64)], colour: [u8; 3]) {
        for (low, high, value) in values {
            let ([left, top], [right, base]) = (self.at([*low, *value]), self.at([*high, 0.0]));
            let _ = write!(
                self.svg,
                r#"<rect x="{left:.1}" y="{top:.1}" width="{:.1}" height="{:.1}" fill="{}"/>"#,
                (right - left - 1.0).max(0.5),
                (base - top).max(0.0),
                hex(colour)
            );
        }
    }

    /// A word for a colour.
    pub fn name(&mut self, colour: [u8; 3], name: &str) {
        self.legend.push((hex(colour), name.to_owned()));
    }

    /// The figure, its legend in the upper right corner of the title's line.
    pub fn finish(mut self) -> Figure {
        let entry = |(colour, name): &(String, String)| {
            format!(r#"<tspan fill="{colour}" font-size="13">●</tspan> {}"#, escape(name))
        };
        let entries: Vec<String> = self.legend.iter().map(entry).collect();
        let _ = write!(
            self.svg,
            r#"<text x="{}" y="17" class="tick" text-anchor="end" xml:space="preserve">{}</text>"#,
            self.size[0] - MARGIN.right,
            entries.join("   ")
        );
        self.svg.push_str("</svg>");
        Figure::new(self.svg)
    }
}

fn finite(values: &[(f64, f64)]) -> impl Iterator<Item = (f64, f64)> + '_ {
    values.iter().copied().filter(|(x, y)| x.is_finite() && y.is_finite())
}

/// Round values inside a span, about `count` of them, and the decimals they need.
pub fn ticks([low, high]: [f64; 2], count: usize) -> (Vec<f64>, usize) {
    let rough = (high - low) / count.max(1) as f64;
    if !(rough > 0.0 && rough.is_finite()) {
        return (vec![low], 0);
    }
    let power = 10.0_f64.powi(rough.log10().floor() as i32);
    let step = [1.0, 2.0, 5.0, 10.0].map(|factor| factor * power).into_iter().find(|step| *step >= rough);
    let step = step.unwrap_or(10.0 * power);
    let first = (low / step).ceil() as i64;
    let last = (high / step).floor() as i64;
    // Zero times a step is a zero without a sign, so that no "-0" is written.
    let values = (first..=last).take(50).map(|k| if k == 0 { 0.0 } else { k as f64 * step }).collect();
    (values, (-step.log10().floor()).clamp(0.0, 9.0) as usize)
}

/// The span of values with a little air, never empty.
pub fn span(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let (low, high) = values
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    match high - low {
        span if span > 0.0 => [low - 0.03 * span, high + 0.05 * span],
        _ if low.is_finite() => [low - 0.5, low + 0.5],
        _ => [0.0, 1.0],
    }
}

/// The same, but a few gross values do not shrink all others to a line: what is far outside the middle 98 % is left
/// beyond the axes.
pub fn robust_span(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let finite: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    let all = || finite.iter().copied();
    let (low, high) =
        (quantile(&mut all().collect::<Vec<f64>>(), 0.01), quantile(&mut all().collect::<Vec<f64>>(), 0.99));
    let reach = (high - low).max(0.0);
    span(all().filter(|value| (low - reach..=high + reach).contains(value)))
}

/// A number that two figures of a page share only if they look the same (FNV-1a).
fn fingerprint(title: &str, spans: &[[f64; 2]]) -> u64 {
    let numbers = spans.iter().flatten().flat_map(|value| value.to_bits().to_le_bytes());
    let bytes = title.bytes().chain(numbers);
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    // Halves are exact.
    #![allow(clippy::float_cmp)]

    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let (values, decimals) = ticks([-0.31, 0.52], 5);
        assert_eq!(decimals, 1);
        let expected = [-0.2, 0.0, 0.2, 0.4];
        assert_eq!(values.len(), expected.len());
        // A product of two doubles is good to a unit in the last place.
        assert!(values.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15), "{values:?}");
        assert_eq!(ticks([1.0, 1.0], 5).0.len(), 1, "an empty span has one tick");
        assert!(ticks([f64::NAN, 1.0], 5).0.len() <= 1);
    }

    #[test]
    fn spans_are_never_empty() {
        assert_eq!(span([].into_iter()), [0.0, 1.0]);
        assert_eq!(span([2.0, f64::NAN, 2.0].into_iter()), [1.5, 2.5]);
        let [low, high] = span([0.0, 1.0].into_iter());
        assert!(low < 0.0 && high > 1.0);
    }

    #[test]
    fn one_gross_value_does_not_rule_the_axis() {
        let values = (0..200).map(|k| f64::from(k) / 200.0).chain([1e6]);
        let [low, high] = robust_span(values);
        assert!((-0.1..0.0).contains(&low) && (0.99..1.2).contains(&high), "{low} {high}");
    }
}
