//! Names in a figure that do not run over each other.

use std::fmt::Write;

use super::svg::escape;

/// Width of a character and height of a line of the small print, pixels: what common fonts have at most on average.
const CHARACTER: f64 = 7.0;
const LINE: f64 = 11.0;

/// Names placed so far, as rectangles: left, top, right, bottom.
#[derive(Debug, Clone)]
pub struct Labels {
    size: [f64; 2],
    taken: Vec<[f64; 4]>,
    /// Names for which there was no room.
    pub left_out: usize,
}

impl Labels {
    /// No names in a figure of this size, the line of the title not counted.
    pub fn new(size: [f64; 2]) -> Self {
        Self { size, taken: Vec::new(), left_out: 0 }
    }

    /// Writes a name beside a place: at the first of four corners where it hides no other name and stays in the figure.
    pub fn place(&mut self, svg: &mut String, [x, y]: [f64; 2], name: &str) {
        let width = CHARACTER * name.chars().count() as f64;
        let corners = [(6.0, 12.0, "start"), (-6.0, 12.0, "end"), (6.0, -5.0, "start"), (-6.0, -5.0, "end")];
        let room = corners.into_iter().find_map(|(dx, dy, anchor)| {
            let left = if anchor == "start" { x + dx } else { x + dx - width };
            let rectangle = [left, y + dy - LINE, left + width, y + dy + 2.0];
            let inside = left >= 0.0 && left + width <= self.size[0];
            let free = |[l, t, r, b]: &[f64; 4]| {
                rectangle[0] >= *r || rectangle[2] <= *l || rectangle[1] >= *b || rectangle[3] <= *t
            };
            (inside && self.taken.iter().all(free)).then_some((rectangle, dx, dy, anchor))
        });
        let Some((rectangle, dx, dy, anchor)) = room else {
            self.left_out += 1;
            return;
        };
        self.taken.push(rectangle);
        // Writing to a string can't fail.
        let _ = write!(
            svg,
            r#"<text x="{:.1}" y="{:.1}" class="tick" text-anchor="{anchor}">{}</text>"#,
            x + dx,
            y + dy,
            escape(name)
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_at_one_place_go_around_it_and_then_are_left_out() {
        let (mut labels, mut svg) = (Labels::new([200.0, 200.0]), String::new());
        for name in ["S1", "S2", "S3", "S4", "S5"] {
            labels.place(&mut svg, [100.0, 100.0], name);
        }
        assert_eq!(svg.matches("<text").count(), 4);
        assert_eq!(labels.left_out, 1);
        labels.place(&mut svg, [20.0, 20.0], "a name far too long for such a narrow figure");
        assert_eq!(labels.left_out, 2);
    }
}
