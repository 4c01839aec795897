//! A grey image with what was found in it.

use std::fmt::Write;

use super::picture::data_uri;
use crate::Result;
use crate::figure::Figure;
use crate::figure::colour::{CATEGORIES, hex};
use crate::figure::svg::{escape, open_svg};

/// A place in an image.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mark {
    /// Pixel position `(col, row)`, integers at pixel centres.
    pub at: [f64; 2],
    /// Drawn as a disc, otherwise as a ring.
    pub is_filled: bool,
    /// Written beside it; empty: nothing.
    pub label: String,
}

/// Width in which an image is shown.
const SHOWN: f64 = 480.0;

/// Radius of a mark: it leaves open what it marks.
const RADIUS: f64 = 4.0;

/// An image of `width` columns from grey values, row by row, with marks and a line through places (col, row).
///
/// # Errors
/// [`Error::Picture`](crate::Error::Picture) where the values fill no whole rows.
///
/// ```
/// let mark = report::Mark { at: [1.0, 0.0], is_filled: false, label: "R017".to_owned() };
/// let figure = report::marked_figure("S00", 3, &[0, 255, 0, 9, 9, 9], &[mark], &[])?;
/// # Ok::<(), report::Error>(())
/// ```
pub fn marked_figure(title: &str, width: usize, grey: &[u8], marks: &[Mark], line: &[[f64; 2]]) -> Result<Figure> {
    let rgb: Vec<u8> = grey.iter().flat_map(|value| [*value; 3]).collect();
    let height = grey.len() / width.max(1);
    let image = data_uri(title, width, height, &rgb)?;
    let scale = SHOWN / width.max(1) as f64;
    let shown_height = scale * height as f64;
    let mut svg = open_svg(title, SHOWN, shown_height + 26.0);
    // Writing to a string can't fail.
    let _ = write!(
        svg,
        r#"<image href="{image}" x="0" y="22" width="{SHOWN}" height="{shown_height:.1}" style="image-rendering:pixelated"/>"#
    );
    // Pixel centres are whole numbers, pixels reach half a pixel beyond them.
    let place = |[col, row]: [f64; 2]| [(col + 0.5) * scale, 22.0 + (row + 0.5) * scale];
    let colour = hex(CATEGORIES[1]);
    let path: Vec<String> = line.iter().map(|at| place(*at)).map(|[x, y]| format!("{x:.1} {y:.1}")).collect();
    if path.len() > 1 {
        let _ = write!(svg, r#"<path d="M{}" fill="none" stroke="{colour}" stroke-opacity="0.7"/>"#, path.join("L"));
    }
    for mark in marks {
        let [x, y] = place(mark.at);
        let fill = if mark.is_filled { colour.as_str() } else { "none" };
        let _ = write!(
            svg,
            r#"<circle cx="{x:.1}" cy="{y:.1}" r="{RADIUS}" fill="{fill}" stroke="{colour}" stroke-width="1.5"/>"#
        );
        if !mark.label.is_empty() {
            let (x, label) = (x + 1.5 * RADIUS, escape(&mark.label));
            let _ = write!(svg, r#"<text x="{x:.1}" y="{y:.1}" font-size="11" fill="{colour}">{label}</text>"#);
        }
    }
    svg.push_str("</svg>");
    Ok(Figure::new(svg))
}
