//! Pictures of rasters: an image inside an SVG figure, with its scale beside it.

use std::fmt::Write;

use base64::Engine;

use crate::figure::Figure;
use crate::figure::colour::ColourMap;
use crate::figure::svg::open_svg;
use crate::{Error, Result};

/// How values become colours, and what they mean.
#[derive(Debug, Clone)]
pub struct Scale {
    /// Colours from `low` to `high`.
    pub map: ColourMap,
    /// Value of the first colour.
    pub low: f64,
    /// Value of the last colour.
    pub high: f64,
    /// Unit of the values, shown beside the bar.
    pub unit: &'static str,
}

impl Scale {
    /// The colour of a value.
    pub fn colour(&self, value: f64) -> [u8; 3] {
        self.map.colour(self.share(value))
    }

    fn share(&self, value: f64) -> f64 {
        (value - self.low) / (self.high - self.low)
    }
}

/// A picture of `width` columns of row-major `values`, with title and colour bar; NaN is grey.
///
/// # Errors
/// [`Error::Picture`] where the values fill no whole rows.
pub fn raster_figure(title: &str, width: usize, values: &[f64], scale: &Scale) -> Result<Figure> {
    let pixels: Vec<u8> = values.iter().flat_map(|&value| scale.colour(value)).collect();
    let height = values.len() / width.max(1);
    let image = data_uri(title, width, height, &pixels)?;
    let shown_width = 300.0;
    let shown_height = shown_width * height as f64 / width.max(1) as f64;
    let mut svg = open_svg(title, shown_width + 70.0, shown_height + 26.0);
    // Writing to a string can't fail.
    let _ = write!(
        svg,
        r#"<image href="{image}" x="0" y="22" width="{shown_width}" height="{shown_height:.1}" style="image-rendering:pixelated"/>"#
    );
    colour_bar(&mut svg, scale, shown_width + 8.0, 22.0, shown_height);
    svg.push_str("</svg>");
    Ok(Figure::new(svg))
}

/// A picture of `width` columns from ready colours, RGB row by row.
///
/// # Errors
/// [`Error::Picture`] where the colours fill no whole rows.
pub fn rgb_figure(title: &str, width: usize, rgb: &[u8]) -> Result<Figure> {
    let height = rgb.len() / (3 * width.max(1));
    let image = data_uri(title, width, height, rgb)?;
    let shown_width = 300.0;
    let shown_height = shown_width * height as f64 / width.max(1) as f64;
    let mut svg = open_svg(title, shown_width, shown_height + 26.0);
    let _ = write!(
        svg,
        r#"<image href="{image}" x="0" y="22" width="{shown_width}" height="{shown_height:.1}" style="image-rendering:pixelated"/></svg>"#
    );
    Ok(Figure::new(svg))
}

/// PNG of RGB pixels as a data URI.
pub(crate) fn data_uri(figure: &str, width: usize, height: usize, rgb: &[u8]) -> Result<String> {
    let fail = |error: png::EncodingError| Error::Picture { figure: figure.to_owned(), source: error };
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().map_err(fail)?;
    writer.write_image_data(rgb).map_err(fail)?;
    writer.finish().map_err(fail)?;
    Ok(format!("data:image/png;base64,{}", base64::engine::general_purpose::STANDARD.encode(bytes)))
}

/// A bar of the scale's colours with its ends and its middle.
pub(crate) fn colour_bar(svg: &mut String, scale: &Scale, x: f64, y: f64, height: f64) {
    const STEPS: usize = 32;
    for step in 0..STEPS {
        let [r, g, b] = scale.map.colour((step as f64 + 0.5) / STEPS as f64);
        let top = y + height * (STEPS - 1 - step) as f64 / STEPS as f64;
        let tall = height / STEPS as f64 + 0.5;
        let _ = write!(svg, r#"<rect x="{x}" y="{top:.2}" width="10" height="{tall:.2}" fill="rgb({r},{g},{b})"/>"#);
    }
    let middle = f64::midpoint(scale.low, scale.high);
    for (value, at) in [(scale.high, y + 9.0), (middle, y + height / 2.0 + 4.0), (scale.low, y + height)] {
        let _ = write!(svg, r#"<text x="{}" y="{at:.1}" class="tick">{}</text>"#, x + 13.0, short(value, scale.unit));
    }
}

fn short(value: f64, unit: &str) -> String {
    let digits = match value.abs() {
        v if v >= 100.0 || v == 0.0 => 0,
        v if v >= 10.0 => 1,
        _ => 2,
    };
    format!("{value:.digits$} {unit}")
}
