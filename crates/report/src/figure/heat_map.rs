//! Correlations as a coloured matrix.

use std::fmt::Write;

use super::Figure;
use super::colour::{ColourMap, hex};
use super::svg::{escape, open_svg};

const CELL: f64 = 26.0;
/// Room for names of two characters at the left and above.
const NARROW: f64 = 44.0;
/// Width of a character of the small print, pixels.
const CHARACTER: f64 = 6.0;
/// Parameters up to which each cell has a colour and a number of its own.
const MOST_CELLS: usize = 40;
/// Colours of the cells of larger matrices.
const SHADES: usize = 41;

/// A square matrix of values from -1 to 1; red for positive, blue for negative. Cells off the diagonal that `is_marked` says
/// of two names have a frame, where each cell is drawn by itself (up to 40 names).
pub fn heat_map(title: &str, names: &[String], matrix: &[Vec<f64>], is_marked: impl Fn(&str, &str) -> bool) -> Figure {
    let side = CELL * names.len() as f64;
    let longest = CHARACTER * names.iter().map(|name| name.chars().count()).max().unwrap_or(0) as f64;
    let margin = NARROW.max(longest + 10.0);
    // Names wider than a cell stand upright above it.
    let upright = longest > CELL;
    let mut svg = open_svg(title, (margin + side + 60.0).max(300.0), margin + side + 8.0);
    for (i, name) in names.iter().enumerate() {
        let (middle, name) = (margin + CELL * (i as f64 + 0.5), escape(name));
        // Writing to a string can't fail.
        let _ = write!(
            svg,
            r#"<text x="{}" y="{:.1}" class="tick" text-anchor="end">{name}</text>"#,
            margin - 5.0,
            middle + 3.5
        );
        let top = margin - 6.0;
        let _ = if upright {
            write!(
                svg,
                r#"<text transform="translate({:.1} {top}) rotate(-90)" class="tick">{name}</text>"#,
                middle + 3.5
            )
        } else {
            write!(svg, r#"<text x="{middle:.1}" y="{top}" class="tick" text-anchor="middle">{name}</text>"#)
        };
    }
    if names.len() > MOST_CELLS {
        shades(&mut svg, matrix, margin);
    } else {
        for (i, row) in matrix.iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                cell(&mut svg, margin, [j, i], *value, i != j && is_marked(&names[i], &names[j]));
            }
        }
    }
    key(&mut svg, margin + side + 14.0, margin, side.clamp(60.0, 220.0));
    svg.push_str("</svg>");
    Figure::new(svg)
}

/// Cells of a large matrix: one path for each shade.
fn shades(svg: &mut String, matrix: &[Vec<f64>], margin: f64) {
    let mut paths = vec![String::new(); SHADES];
    for (i, row) in matrix.iter().enumerate() {
        for (j, value) in row.iter().enumerate() {
            let shade = (f64::midpoint(value.clamp(-1.0, 1.0), 1.0) * (SHADES - 1) as f64).round() as usize;
            let (x, y) = (margin + CELL * j as f64, margin + CELL * i as f64);
            let _ = write!(paths[shade], "M{x} {y}h25v25h-25z");
        }
    }
    for (shade, path) in paths.iter().enumerate().filter(|(_, path)| !path.is_empty()) {
        let fill = hex(ColourMap::Diverging.colour(shade as f64 / (SHADES - 1) as f64));
        let _ = write!(svg, r#"<path d="{path}" fill="{fill}"/>"#);
    }
}

fn cell(svg: &mut String, margin: f64, [column, row]: [usize; 2], value: f64, marked: bool) {
    let (x, y) = (margin + CELL * column as f64, margin + CELL * row as f64);
    let fill = hex(ColourMap::Diverging.colour(f64::midpoint(value, 1.0)));
    let _ = write!(svg, r#"<rect x="{x}" y="{y}" width="{}" height="{}" fill="{fill}"/>"#, CELL - 1.0, CELL - 1.0);
    if value.abs() >= 0.5 && column != row {
        let ink = if value.abs() > 0.75 { "#fff" } else { "#222" };
        let _ = write!(
            svg,
            r#"<text x="{}" y="{}" text-anchor="middle" style="font:8.5px system-ui,sans-serif" fill="{ink}">{}</text>"#,
            x + CELL / 2.0 - 0.5,
            y + CELL / 2.0 + 2.5,
            short(value)
        );
    }
    if marked {
        let _ = write!(
            svg,
            r##"<rect x="{}" y="{}" width="{}" height="{}" fill="none" stroke="#111" stroke-width="1.6"/>"##,
            x + 0.5,
            y + 0.5,
            CELL - 2.0,
            CELL - 2.0
        );
    }
}

/// Three decimals where two would round to one.
fn short(value: f64) -> String {
    let text = if value.abs() >= 0.995 { format!("{value:.3}") } else { format!("{value:.2}") };
    text.replacen("0.", ".", 1)
}

fn key(svg: &mut String, x: f64, top: f64, height: f64) {
    const STEPS: usize = 40;
    for step in 0..STEPS {
        let fill = hex(ColourMap::Diverging.colour(1.0 - (step as f64 + 0.5) / STEPS as f64));
        let y = top + height * step as f64 / STEPS as f64;
        let _ = write!(
            svg,
            r#"<rect x="{x}" y="{y:.2}" width="10" height="{:.2}" fill="{fill}"/>"#,
            height / STEPS as f64 + 0.5
        );
    }
    for (text, y) in [("+1", 8.0), ("0", height / 2.0 + 4.0), ("-1", height)] {
        let _ = write!(svg, r#"<text x="{}" y="{:.1}" class="tick">{text}</text>"#, x + 14.0, top + y);
    }
}
