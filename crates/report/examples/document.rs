//! A measured wall as text on the terminal and as a page on the standard output of `--html`.

use report::{Axes, CATEGORIES, Column, Document, Merit, Series, curves};

#[allow(clippy::print_stdout)]
fn main() {
    let mut document = Document::new("A wall", "Distances of a wall at 3 m, each the mean of 100 frames.");
    document.merits(vec![Merit::new("1.2 mm", "rms of the residuals")]);
    document.section("Residuals");
    let residuals_mm = [(0.0, 0.4), (1.0, -1.1), (2.0, 1.6), (3.0, -0.9)];
    let rows = residuals_mm.iter().map(|(at, mm)| vec![format!("{at:.0}"), format!("{mm:+.1}")]);
    document.table([Column::number("time").unit("min"), Column::number("residual").unit("mm")], rows.collect());
    let axes = Axes { title: "Residuals", x: "time, min", y: "residual, mm" };
    let series = [Series { name: "mean of 100 frames", colour: CATEGORIES[0], values: residuals_mm.to_vec() }];
    document.figures(vec![curves(&axes, &series).caption("What drifts is not yet warm.")]);
    let html = std::env::args().any(|argument| argument == "--html");
    println!("{}", if html { document.html() } else { document.to_string() });
}
