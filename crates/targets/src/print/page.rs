//! A page with a scale bar.

use std::fmt::Write;

use crate::error::{Error, Result};

/// White about everything, millimetre: no printer reaches the rim of the paper.
const MARGIN_MM: f64 = 10.0;
/// Height of the strip with bar and note, millimetre.
const STRIP_MM: f64 = 20.0;
/// Length of the scale bar, millimetre.
const BAR_MM: f64 = 100.0;

/// What every page says of ink and near infrared.
pub const INFRARED_NOTE: &str = "Near infrared: laser toner and pigment black are carbon and stay black; dyes of ink-jet printers \
                                 reflect like paper, and the target is not seen.";

/// Paper of the A series (ISO 216), upright or across as the target needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PaperSize {
    /// 210 x 297 mm.
    #[default]
    A4,
    /// 297 x 420 mm.
    A3,
    /// 420 x 594 mm.
    A2,
    /// 594 x 841 mm.
    A1,
    /// 841 x 1189 mm.
    A0,
}

impl PaperSize {
    fn sides_mm(self) -> [f64; 2] {
        match self {
            Self::A4 => [210.0, 297.0],
            Self::A3 => [297.0, 420.0],
            Self::A2 => [420.0, 594.0],
            Self::A1 => [594.0, 841.0],
            Self::A0 => [841.0, 1189.0],
        }
    }

    /// Width and height of the page that takes a target of a size (millimetre).
    pub(super) fn page_mm(self, size: [f64; 2]) -> Result<[f64; 2]> {
        let [short, long] = self.sides_mm();
        let room = |[width, height]: [f64; 2]| [width - 2.0 * MARGIN_MM, height - 2.0 * MARGIN_MM - STRIP_MM];
        let pages = [[short, long], [long, short]];
        let fits = |page: &&[f64; 2]| (0..2).all(|axis| size[axis] <= room(**page)[axis]);
        let expected = "a target that fits the page with 10 mm about it and 20 mm below: take a larger paper";
        let value = size[0].max(size[1]);
        pages.iter().find(fits).copied().ok_or(Error::Invalid { name: "size_mm", value, expected })
    }

    /// Width and height that a page has for targets, upright, millimetre.
    pub(super) fn room_mm(self) -> [f64; 2] {
        let [short, long] = self.sides_mm();
        [short - 2.0 * MARGIN_MM, long - 2.0 * MARGIN_MM - STRIP_MM]
    }
}

/// A page that shapes are drawn on.
pub(super) struct Page {
    text: String,
    size_mm: [f64; 2],
    /// Where the target's upper left corner lies.
    corner_mm: [f64; 2],
}

impl Page {
    /// A page with room for a target of a size, millimetre.
    pub(super) fn new(paper: PaperSize, size: [f64; 2]) -> Result<Self> {
        let [width, height] = paper.page_mm(size)?;
        let corner_mm = [0.5 * (width - size[0]), 0.5 * (height - STRIP_MM - size[1])];
        let mut page = Self { text: String::new(), size_mm: [width, height], corner_mm };
        page.line(&format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}mm\" height=\"{height}mm\" viewBox=\"0 0 {width} {height}\">"
        ));
        page.line(&format!("<rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>"));
        Ok(page)
    }

    fn line(&mut self, line: &str) {
        self.text.push_str(line);
        self.text.push('\n');
    }

    fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.corner_mm[0] + x, self.corner_mm[1] + y]
    }

    /// A disc, from the target's upper left corner, millimetre, y downwards.
    pub(super) fn disc(&mut self, centre: [f64; 2], radius: f64, colour: &str) {
        let [x, y] = self.place(centre);
        self.line(&format!("<circle cx=\"{x:.4}\" cy=\"{y:.4}\" r=\"{radius:.4}\" fill=\"{colour}\"/>"));
    }

    pub(super) fn rectangle(&mut self, corner: [f64; 2], [width, height]: [f64; 2], colour: &str) {
        let [x, y] = self.place(corner);
        let shape = format!("x=\"{x:.4}\" y=\"{y:.4}\" width=\"{width:.4}\" height=\"{height:.4}\"");
        self.line(&format!("<rect {shape} fill=\"{colour}\"/>"));
    }

    /// The part of a ring between two angles (radian, clockwise as seen, from the right), less than half a turn apart.
    pub(super) fn sector(&mut self, centre: [f64; 2], [inner, outer]: [f64; 2], [from, to]: [f64; 2], colour: &str) {
        let centre = self.place(centre);
        let at = |radius: f64, angle: f64| {
            let [x, y] = [centre[0] + radius * angle.cos(), centre[1] + radius * angle.sin()];
            format!("{x:.4} {y:.4}")
        };
        let mut path = format!("M {} A {outer:.4} {outer:.4} 0 0 1 {}", at(outer, from), at(outer, to));
        let back = (at(inner, to), at(inner, from));
        // Writing to a string does not fail.
        let _ = write!(path, " L {} A {inner:.4} {inner:.4} 0 0 0 {} Z", back.0, back.1);
        self.line(&format!("<path d=\"{path}\" fill=\"{colour}\"/>"));
    }

    pub(super) fn text(&mut self, [x, y]: [f64; 2], text: &str) {
        let [x, y] = self.place([x, y]);
        self.line(&format!("<text x=\"{x:.4}\" y=\"{y:.4}\" font-size=\"3\" font-family=\"sans-serif\">{text}</text>"));
    }

    /// The page with its bar and its note on the target and the printer.
    pub(super) fn finished(mut self, name: &str) -> String {
        let (left, bottom) = (MARGIN_MM, self.size_mm[1] - MARGIN_MM);
        self.corner_mm = [0.0, 0.0];
        self.rectangle([left, bottom - 14.0], [BAR_MM, 1.0], "black");
        for end in [left, left + BAR_MM - 0.2] {
            self.rectangle([end, bottom - 16.0], [0.2, 5.0], "black");
        }
        self.text([left + BAR_MM + 3.0, bottom - 12.0], "100 mm: print at 100 % and measure");
        self.text([left, bottom - 5.0], name);
        self.text([left, bottom], INFRARED_NOTE);
        self.line("</svg>");
        self.text
    }
}
