//! Correlations as a coloured matrix.

use std::fmt::Write;

use crate::report::colour::{ColourMap, hex};
use crate::report::picture::{escape, open_svg};

/// Pairs that networks of range cameras hardly separate, and what separates them.
const NOTORIOUS: [(&str, &str, &str); 12] = [
    ("xp", "p1", "cameras rolled by 90 degrees about the viewing axis"),
    ("yp", "p2", "cameras rolled by 90 degrees about the viewing axis"),
    ("xp", "e1", "targets at different ranges in each half of the image"),
    ("yp", "e2", "targets at different ranges in each half of the image"),
    ("c", "d0", "a known distance, or targets at different depths"),
    ("c", "k1", "targets out to the corners of the image"),
    ("k1", "k2", "targets out to the corners of the image"),
    ("k2", "k3", "targets out to the corners of the image; or hold k3"),
    ("k1", "k3", "targets out to the corners of the image; or hold k3"),
    ("d0", "d2", "ranges over a whole ambiguity interval, or a known distance"),
    ("d0", "d3", "ranges over a whole ambiguity interval, or a known distance"),
    ("d2", "d3", "ranges over a whole ambiguity interval"),
];

const CELL: f64 = 26.0;
const LEFT: f64 = 44.0;
const TOP: f64 = 44.0;

/// The matrix; red for positive, blue for negative.
pub(super) fn heat_map(names: &[String], matrix: &[Vec<f64>]) -> String {
    let side = CELL * names.len() as f64;
    let mut svg = open_svg("Correlations of the estimated parameters", LEFT + side + 60.0, TOP + side + 8.0);
    for (i, name) in names.iter().enumerate() {
        let (middle, name) = (CELL * (i as f64 + 0.5), escape(name));
        // Writing to a string can't fail.
        let _ = write!(
            svg,
            r#"<text x="{}" y="{:.1}" class="tick" text-anchor="end">{name}</text><text x="{:.1}" y="{}" class="tick" text-anchor="middle">{name}</text>"#,
            LEFT - 5.0,
            TOP + middle + 3.5,
            LEFT + middle,
            TOP - 6.0
        );
    }
    for (i, row) in matrix.iter().enumerate() {
        for (j, value) in row.iter().enumerate() {
            cell(&mut svg, [j, i], *value, i != j && is_notorious(&names[i], &names[j]));
        }
    }
    key(&mut svg, LEFT + side + 14.0, side.clamp(60.0, 220.0));
    svg.push_str("</svg>");
    svg
}

fn cell(svg: &mut String, [column, row]: [usize; 2], value: f64, marked: bool) {
    let (x, y) = (LEFT + CELL * column as f64, TOP + CELL * row as f64);
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

fn key(svg: &mut String, x: f64, height: f64) {
    const STEPS: usize = 40;
    for step in 0..STEPS {
        let fill = hex(ColourMap::Diverging.colour(1.0 - (step as f64 + 0.5) / STEPS as f64));
        let y = TOP + height * step as f64 / STEPS as f64;
        let _ = write!(
            svg,
            r#"<rect x="{x}" y="{y:.2}" width="10" height="{:.2}" fill="{fill}"/>"#,
            height / STEPS as f64 + 0.5
        );
    }
    for (text, y) in [("+1", 8.0), ("0", height / 2.0 + 4.0), ("-1", height)] {
        let _ = write!(svg, r#"<text x="{}" y="{:.1}" class="tick">{text}</text>"#, x + 14.0, TOP + y);
    }
}

/// Names without the integration time they may carry.
fn is_notorious(a: &str, b: &str) -> bool {
    let (a, b) = (base(a), base(b));
    NOTORIOUS.iter().any(|(p, q, _)| (*p == a && *q == b) || (*p == b && *q == a))
}

fn base(name: &str) -> &str {
    name.split('@').next().unwrap_or(name)
}

/// Rows of the table of notorious pairs that are both estimated.
pub(super) fn notorious_pairs(names: &[String], matrix: &[Vec<f64>]) -> Vec<Vec<String>> {
    let find = |wanted: &str| names.iter().position(|name| name == wanted);
    let row = |(a, b, cure): &(&str, &str, &str)| {
        let value = *matrix.get(find(a)?)?.get(find(b)?)?;
        Some(vec![format!("{a} – {b}"), format!("{value:+.3}"), (*cure).to_owned()])
    };
    NOTORIOUS.iter().filter_map(row).collect()
}
